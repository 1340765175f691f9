"""Runs workers and pipelines in turns, and says what they took."""

import contextlib
import os
import pathlib
import statistics
import subprocess
import time
from dataclasses import dataclass

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", "target"))
BIN = (ROOT / TARGET / "release").resolve()
VENV_PYTHON = ROOT / TARGET / "venv-bench" / "bin" / "python"
PEERS = ROOT / "benches" / "peers"

# Settings of numpy's linear algebra that a machine may carry; peers run as they are installed.
NOT_FOR_PEERS = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")


class Failed(Exception):
    """A program did not do its work; the text says which and why."""


def environment(ours, vectors=None):
    """What a program is started with: ours with a set of vector instructions, peers without settings of their libraries."""
    variables = dict(os.environ)
    variables.pop("CYANOMETER_VECTORS", None)
    if vectors:
        variables["CYANOMETER_VECTORS"] = vectors
    if not ours:
        for name in NOT_FOR_PEERS:
            variables.pop(name, None)
        variables["PYTHONPATH"] = str(PEERS)
        variables["PYTHONDONTWRITEBYTECODE"] = "1"
    return variables


@contextlib.contextmanager
def on_cores(count):
    """What is started meanwhile runs on so many cores; None for all."""
    if count is None or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(sorted(before)[-count:]))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def cores():
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


class Worker:
    """A kernel in a process of its own that waits for its turns, on one core."""

    def __init__(self, command, variables):
        self.words = [str(word) for word in command]
        with on_cores(1):
            self.process = subprocess.Popen(
                self.words + ["--step"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env=variables,
                cwd=ROOT,
            )
        self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            complaint = self.process.stderr.read().strip().splitlines()
            self.close()
            raise Failed(f"{' '.join(self.words[:4])}: {complaint[-1] if complaint else 'it says nothing'}")
        return line

    def turn(self):
        """CPU and clock seconds of one run."""
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        cpu_s, clock_s = self.answer().split()
        return float(cpu_s), float(clock_s)

    def close(self):
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            with contextlib.suppress(BrokenPipeError):
                stream.close()
        self.process.wait()


def ours(kernel, size, vectors=None):
    """A kernel of studies/src/bin/bench-kernels.rs."""
    return [BIN / "bench-kernels", kernel, size, 999], environment(True, vectors)


def peer(script, workload, size):
    """A workload of benches/peers."""
    return [VENV_PYTHON, PEERS / f"{script}.py", workload, size, 999], environment(False)


def in_turns(workers, repeats):
    """Median CPU seconds of each of the named workers (command and environment), run by run in turns on one core, and why
    those that are missing are."""
    started, failures = {}, {}
    try:
        for name, (command, variables) in workers.items():
            try:
                started[name] = Worker(command, variables)
            except (Failed, OSError) as problem:
                failures[name] = str(problem)
        taken = {name: [] for name in started}
        for _ in range(repeats):
            for name, worker in started.items():
                if name in failures:
                    continue
                try:
                    taken[name].append(worker.turn()[0])
                except (Failed, OSError) as problem:
                    failures[name] = str(problem)
        return {name: statistics.median(values) for name, values in taken.items() if name not in failures}, failures
    finally:
        for worker in started.values():
            worker.close()


@dataclass
class Taken:
    """What one process took, or the processes of a pipeline together: the largest peak, the sum of CPU times."""

    clock_s: float
    cpu_s: float
    peak_kib: int
    stages: list = None


def pipeline(commands, folder, count=None, variables=None, output=None):
    """Runs processes, each reading what the one before writes, the last into `output` or nowhere."""
    if variables is None:
        variables = environment(True)
    reports = [folder / f"report-{index}" for index in range(len(commands))]
    processes = []
    launcher = BIN / "bench-process"
    with contextlib.ExitStack() as stack:
        sink = stack.enter_context(open(output or os.devnull, "wb"))
        errors = stack.enter_context(open(folder / "errors", "w+", encoding="utf-8"))
        start = time.perf_counter()
        with on_cores(count):
            reading = subprocess.DEVNULL
            for index, command in enumerate(commands):
                last = index == len(commands) - 1
                words = [str(word) for word in (launcher, reports[index], *command)]
                process = subprocess.Popen(
                    words, stdin=reading, stdout=sink if last else subprocess.PIPE, stderr=errors, env=variables, cwd=folder
                )
                if index > 0:
                    reading.close()
                reading = process.stdout
                processes.append(process)
        try:
            statuses = [process.wait() for process in processes]
        except BaseException:
            for process in processes:
                process.terminate()
                process.wait()
            raise
        clock_s = time.perf_counter() - start
        if any(statuses):
            errors.seek(0)
            complaint = errors.read().strip().splitlines()
            raise Failed(complaint[-1] if complaint else f"exit statuses {statuses}")
    stages = []
    for report in reports:
        clock, user, system, peak = report.read_text(encoding="utf-8").split()
        stages.append(Taken(float(clock), float(user) + float(system), int(peak)))
        report.unlink()
    return Taken(clock_s, sum(s.cpu_s for s in stages), max(s.peak_kib for s in stages), stages)


def alternate(runs, repeats):
    """Runs functions that give Taken in turns; the median of each by the clock, with medians of CPU and the largest peaks."""
    taken, failures = {name: [] for name in runs}, {}
    for _ in range(repeats):
        for name, run in runs.items():
            if name in failures:
                continue
            try:
                taken[name].append(run())
            except (Failed, OSError) as problem:
                failures[name] = str(problem)
    middle = {}
    for name, values in taken.items():
        if name in failures or not values:
            continue
        stages = [
            Taken(
                statistics.median(v.stages[i].clock_s for v in values),
                statistics.median(v.stages[i].cpu_s for v in values),
                max(v.stages[i].peak_kib for v in values),
            )
            for i in range(len(values[0].stages))
        ]
        clock_s = statistics.median(v.clock_s for v in values)
        middle[name] = Taken(clock_s, statistics.median(v.cpu_s for v in values), max(v.peak_kib for v in values), stages)
    return middle, failures
