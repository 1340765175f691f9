"""Whole programs and pipelines, from start to exit."""

import subprocess

import measuring
from measuring import BIN, PEERS, ROOT, VENV_PYTHON, Taken
from tables import Topic, below, figures, goal

SKIES = ROOT / "sample_data" / "skies"
SKY = SKIES / "clear_zenith.csv"
SENSORS = ROOT / "sample_data" / "sensors"
PROGRAMS = ["render-radiance", "mosaic", "add-noise", "digitize", "demosaic", "to-xyz", "measure"]
MIB = 1024


def count(size):
    width, height = size.split("x")
    return int(width) * int(height)


class Bench:
    """The files that programs read, and how they are called."""

    def __init__(self, settings):
        self.settings = settings
        self.folder = settings.folder
        self.matrix = self.folder / "matrix.yaml"
        measuring.pipeline([[BIN / "fit-matrix", SKIES / "sky912.exr", "-q", "-o", self.matrix]], self.folder)
        self.own_kib = {name: self.run([[BIN / name, "--version"]]).peak_kib for name in PROGRAMS}

    def run(self, commands, cores=None, output=None):
        return measuring.pipeline(commands, self.folder, cores, output=output)

    def stages(self, size, order=PROGRAMS):
        """The commands of the pipeline of one uniform sky."""
        arguments = {
            "render-radiance": [SKY, "--size", size, *([] if "mosaic" in order else ["--cfa", "rggb"])],
            "demosaic": ["--method", "bi"],
            "to-xyz": ["--matrix", self.matrix],
        }
        return [[BIN / name, *arguments.get(name, []), "-q"] for name in order]

    def beyond_code_mib(self, name, taken):
        """Peak memory less that of --version, in MiB."""
        return (taken.peak_kib - self.own_kib[name]) / MIB

    def chain(self, way, size):
        """One of the chains in Python, in a process of its own."""
        command = [VENV_PYTHON, PEERS / "chain.py", way, SKY, SENSORS, self.matrix, size]
        return measuring.pipeline([command], self.folder, variables=measuring.environment(False))


RENDERED = [name for name in PROGRAMS if name != "mosaic"]
LATE = ["render-radiance", "add-noise", "digitize", "mosaic", "demosaic", "to-xyz", "measure"]


def ramp_file(bench, size):
    """A CFA plane whose light rises from 10 to 30 000 e⁻, with the metadata that render-radiance writes."""
    model = bench.folder / "model.exr"
    ramp = bench.folder / "ramp.exr"
    bench.run([[BIN / "render-radiance", "--electrons", "1,1,1", "--size", size, "--cfa", "rggb", "-q", "-o", model]])
    kept, keep = [], True
    for line in (bench.folder / "model.exr.yaml").read_text(encoding="utf-8").splitlines():
        if not line.startswith((" ", "-")):
            keep = line.split(":")[0] not in ("scene", "samples", "predicted", "left_out")
        if keep:
            kept.append(line)
    (bench.folder / "ramp.exr.yaml").write_text("\n".join(kept) + "\n", encoding="utf-8")
    make_with_peers("exr.write(arguments[0], {'Y': turns.ramp(*map(int, arguments[1].split('x')))})", ramp, size)
    return ramp


def spectral_file(bench, size):
    """A spectral image of 471 bands."""
    image = bench.folder / "spectral.exr"
    make_with_peers(
        "width, height = map(int, arguments[1].split('x')); "
        "planes = spectral.radiance(width * height).reshape(471, height, width); "
        "exr.write(arguments[0], {f'S0.{360 + i},000000nm': plane for i, plane in enumerate(planes)})",
        image,
        size,
    )
    return image


def make_with_peers(line, *arguments):
    """Runs a line of Python that has the modules of benches/peers and `arguments`."""
    line = f"import sys, exr, spectral, turns; arguments = sys.argv[1:]; {line}"
    command = [str(word) for word in (VENV_PYTHON, "-c", line, *arguments)]
    subprocess.run(command, check=True, env=measuring.environment(False))


def arithmetic(worker):
    """A turn of a kernel as if it were a process without memory of its own."""
    cpu_s, clock_s = worker.turn()
    return Taken(clock_s, cpu_s, 0, [])


def programs(settings):
    """Each program from file to file, and two beside the arithmetic of numpy."""
    bench, size = Bench(settings), settings.size
    at = bench.folder
    ramp = ramp_file(bench, size)
    spectral_size = "256x128" if settings.quick else "512x256"
    image = spectral_file(bench, spectral_size)
    runs = {
        "render-radiance, three planes": [SKY, "--size", size, "-o", at / "expected.exr"],
        "mosaic": [at / "expected.exr", "-o", at / "plane.exr"],
        "add-noise, CFA plane": [ramp, "-o", at / "noisy.exr"],
        "digitize, to 16-bit TIFF": [at / "noisy.exr", "-o", at / "codes.tiff"],
        "demosaic, BI": [at / "codes.tiff", "--method", "bi", "-o", at / "rgb.exr"],
        "demosaic, ECI": [at / "codes.tiff", "--method", "eci", "-o", at / "rgb.exr"],
        "to-xyz": [at / "rgb.exr", "--matrix", bench.matrix, "-o", at / "xyz.exr"],
        "measure": [at / "xyz.exr"],
        "render-radiance, 471 bands": [image, "-o", at / "skies.exr"],
    }
    program = {name: name.split(",")[0] for name in runs}

    def one(name):
        return lambda: bench.run([[BIN / program[name], *runs[name], "-q"]], cores=1)

    turns, workers, failures = {name: one(name) for name in runs}, [], {}
    peers = {
        "numpy's noise": measuring.peer("noise", "plane", size),
        "numpy's tensordot": measuring.peer("spectral", "planes", spectral_size),
    }
    for name, (command, variables) in peers.items():
        try:
            worker = measuring.Worker(command, variables)
        except (measuring.Failed, OSError) as problem:
            failures[name] = str(problem)
            continue
        workers.append(worker)
        turns[name] = lambda worker=worker: arithmetic(worker)
    try:
        taken, failed = measuring.alternate(turns, settings.repeats)
    finally:
        for worker in workers:
            worker.close()
    topic = Topic(
        "programs",
        "Programs, file to file",
        f"Whole processes on one core, from start to exit, uncompressed EXR but where a row says otherwise, in the "
        f"system's cache: {size}; the spectral image {spectral_size} of 471 bands. The light of add-noise is the ramp from "
        "10 to 30 000 e⁻. Memory: peak, less that of the same program's `--version`. The peers are numpy's arithmetic "
        "alone, in memory, as in the tables of kernels: neither its start nor a file.",
        ["what", "clock, s", "CPU, s", "memory, MiB", "peer", "clock, ratio", "CPU, ratio", "goal by the clock"],
    )
    versus = {
        "add-noise, CFA plane": ("numpy's noise", 4),
        "render-radiance, 471 bands": ("numpy's tensordot", None),
    }
    for name in runs:
        if name not in taken:
            continue
        mine = taken[name]
        cells = [figures(mine.clock_s), figures(mine.cpu_s), f"{bench.beyond_code_mib(program[name], mine):.1f}"]
        peer, least = versus.get(name, (None, None))
        if peer in taken:
            other = taken[peer]
            ratio = other.clock_s / mine.clock_s
            cells += [f"{peer}: {figures(other.clock_s)} s, CPU {figures(other.cpu_s)} s", figures(ratio)]
            cells += [figures(other.cpu_s / mine.cpu_s), goal(ratio, least) if least else ""]
        else:
            cells += [""] * 4
        topic.rows.append([name, *cells])
    topic.missing(failures | failed)
    return topic


def pipeline(settings):
    """Seven processes beside one process of Python."""
    bench, size = Bench(settings), settings.size
    taken, failures = measuring.alternate(
        {
            "mosaic first": lambda: bench.run(bench.stages(size)),
            "mosaic late": lambda: bench.run(bench.stages(size, LATE)),
            "mosaic rendered": lambda: bench.run(bench.stages(size, RENDERED)),
            "numpy": lambda: bench.chain("numpy", size),
            "OpenCV": lambda: bench.chain("opencv", size),
            "numpy, 16x12": lambda: bench.chain("numpy", "16x12"),
            "OpenCV, 16x12": lambda: bench.chain("opencv", "16x12"),
        },
        settings.repeats,
    )
    topic = Topic(
        "pipeline",
        "The chain as a pipeline",
        f"From the spectrum of a clear sky to mean and covariance of XYZ, {size}, {measuring.cores()} cores, clock from start "
        "to exit. Ours: `render-radiance | mosaic | add-noise | digitize | demosaic --method bi | to-xyz --matrix … | "
        "measure`, seven processes. numpy + colour-demosaicing + colour: one process, as one writes it down: noise and "
        "converter on three planes of doubles, then the mosaic. numpy + OpenCV: one process, the mosaic first, 32-bit "
        "floats, `cvtColor` and `transform`. Nothing is written to files, on either side.",
        ["peer", "ours, s", "peer, s", "ratio", "CPU, ours, s", "CPU, peer, s", "CPU, ratio", "goal by the clock"],
    )
    pairs = [
        ("numpy + colour-demosaicing + colour", "mosaic first", "numpy", 20),
        ("numpy + OpenCV, mosaic first", "mosaic first", "OpenCV", 4),
        ("ours with the mosaic late", "mosaic first", "mosaic late", 2),
        ("the same, beside `render-radiance --cfa rggb`", "mosaic rendered", "mosaic late", None),
    ]
    for what, ours, peer, least in pairs:
        if peer in taken and ours in taken:
            mine, other = taken[ours], taken[peer]
            ratio = other.clock_s / mine.clock_s
            cells = [figures(mine.clock_s), figures(other.clock_s), figures(ratio)]
            cells += [figures(mine.cpu_s), figures(other.cpu_s), figures(other.cpu_s / mine.cpu_s)]
            topic.rows.append([what, *cells, goal(ratio, least) if least else ""])
            if start := taken.get(f"{peer}, 16x12"):
                other = Taken(other.clock_s - start.clock_s, other.cpu_s - start.cpu_s, other.peak_kib)
                cells = [figures(mine.clock_s), figures(other.clock_s), figures(other.clock_s / mine.clock_s)]
                cells += [figures(mine.cpu_s), figures(other.cpu_s), figures(other.cpu_s / mine.cpu_s)]
                topic.rows.append(["the same less its start", *cells, ""])
    for name in ("numpy", "OpenCV"):
        if name in taken and f"{name}, 16x12" in taken:
            start = taken[f"{name}, 16x12"]
            topic.notes.append(
                f"The process of numpy + {'OpenCV' if name == 'OpenCV' else 'colour'} takes {figures(start.clock_s)} s "
                f"(CPU {figures(start.cpu_s)} s) on a frame of 16x12, to start and import what it needs; its peak on the whole "
                f"frame is {taken[name].peak_kib / MIB:,.0f} MiB."
            )
    topic.notes.append(digests(bench, size))
    topic.missing(failures)
    return [topic] + memory_of_stages(bench, taken)


def digests(bench, size):
    """Whether all orders give the same samples."""
    found = set()
    for order in (PROGRAMS, LATE, RENDERED):
        output = bench.folder / "xyz.exr"
        commands = bench.stages(size, order[:-1])
        commands[-1] += ["-o", output]
        bench.run(commands)
        sidecar = (bench.folder / "xyz.exr.yaml").read_text(encoding="utf-8")
        found.add(sidecar.split("digest:")[1].split()[0])
    told = ", ".join(f"`{digest[:19]}…`" for digest in sorted(found))
    words = "give the same samples" if len(found) == 1 else "DIFFER in the samples"
    return f"Mosaic first, mosaic late, and the planes that it drops not rendered, {words} of XYZ: {told}."


def memory_of_stages(bench, taken):
    if "mosaic first" not in taken:
        return []
    topic = Topic(
        "pipeline",
        "Each stage of the pipeline",
        "The same runs, process by process: CPU time, and peak resident memory less that of the same program's `--version` "
        "run.",
        ["stage", "CPU, s", "memory, MiB", "with code, MiB", "goal"],
    )
    for name, stage in zip(PROGRAMS, taken["mosaic first"].stages):
        memory = bench.beyond_code_mib(name, stage)
        cells = [figures(stage.cpu_s), f"{memory:.1f}", f"{stage.peak_kib / MIB:.1f}", below(memory, 16, "MiB")]
        topic.rows.append([name, *cells])
    return [topic]


# A frame that takes no time but that of starting.
SMALLEST = "16x12"
# About 0.1, 1, 10 and 100 million photosites, 4 to 3.
PIXEL_SIZES = ["366x274", "1154x866", "3652x2738", "11548x8660"]
# Frames that a peer holds in memory whole are left out above so many pixels.
PEER_HEADS = ["numpy + colour", "numpy + OpenCV"]
MOST_PIXELS = {"numpy": 2e6, "OpenCV": 2e7}


def pixels(settings):
    """Time and memory of the pipeline, from small frames to large ones."""
    bench = Bench(settings)
    topic = Topic(
        "pixels",
        "Small frames and large",
        f"The pipeline of seven processes, as above, {measuring.cores()} cores, from 0.1 to 100 Mpix. CPU: of all processes. "
        "Memory: the peak of the largest stage, less that of its `--version`; and the peaks of all seven added up, code "
        "included. To the right the peers, their memory likewise with code; they hold frames whole and are left out above "
        f"2 Mpix (numpy + colour) and 20 Mpix (numpy + OpenCV). Less the start: less the clock of a frame of {SMALLEST}, which "
        "is that of seven processes that start and hand on what they know of the frame.",
        ["frame", "clock, s", "clock, ns/pix", "less the start", "CPU, ns/pix", "largest stage, MiB", "all with code, MiB"]
        + PEER_HEADS,
        plots={"ours": [], "numpy": [], "OpenCV": []},
    )
    steady, starts = [], []
    sizes = PIXEL_SIZES[:-1] if settings.quick else PIXEL_SIZES
    for size in sizes:
        runs = {"ours": lambda size=size: bench.run(bench.stages(size))}
        runs["start"] = lambda: bench.run(bench.stages(SMALLEST))
        for name, most in MOST_PIXELS.items():
            if count(size) <= most:
                runs[name] = lambda name=name, size=size: bench.chain(name.lower(), size)
        repeats = settings.repeats if count(size) < 2e7 else min(settings.repeats, 3)
        if settings.quick and count(size) > 2e6:
            repeats = 1
        taken, failures = measuring.alternate(runs, repeats)
        topic.missing(failures)
        if "ours" not in taken or "start" not in taken:
            continue
        mine = taken["ours"]
        without_start_s = mine.clock_s - taken["start"].clock_s
        memory = max(bench.beyond_code_mib(name, stage) for name, stage in zip(PROGRAMS, mine.stages))
        row = [size, figures(mine.clock_s), figures(mine.clock_s / count(size) * 1e9)]
        row.append(figures(without_start_s / count(size) * 1e9))
        together = sum(stage.peak_kib for stage in mine.stages) / MIB
        row += [figures(mine.cpu_s / count(size) * 1e9), f"{memory:.1f}", f"{together:.0f}"]
        topic.plots["ours"].append([count(size), mine.clock_s, together])
        if count(size) > 9e5:
            starts.append(taken["start"].clock_s)
            per_pixel = [time_s / count(size) for time_s in (mine.clock_s, without_start_s, mine.cpu_s)]
            steady.append((*per_pixel, memory))
        for name in ("numpy", "OpenCV"):
            if name in taken:
                other = taken[name]
                topic.plots[name].append([count(size), other.clock_s, other.peak_kib / MIB])
                per_pixel = figures(other.clock_s / count(size) * 1e9)
                row.append(f"{per_pixel} ns/pix, {other.peak_kib / MIB:,.0f} MiB")
            else:
                row.append("")
        topic.rows.append(row)
    if len(steady) > 1:
        clocks, less_start, cpus, memories = zip(*steady)
        spread = percent(clocks)
        topic.notes.append(
            f"From 1 to {topic.plots['ours'][-1][0] / 1e6:.0f} Mpix, clock time per pixel differs by {spread:.0f} %, by "
            f"{percent(less_start):.0f} % less the start of {1e3 * min(starts):.0f} to {1e3 * max(starts):.0f} ms, and CPU time by "
            f"{percent(cpus):.0f} %; the goal of at most 20 % by the clock is {'reached' if spread <= 20 else 'not reached'}. "
            f"The memory of the largest stage lies between {min(memories):.1f} and {max(memories):.1f} MiB."
        )
    return topic


def percent(values):
    """By how much the largest exceeds the smallest."""
    return (max(values) / min(values) - 1) * 100


def stages(settings):
    """Pipelines of one stage, two, and so on to seven."""
    bench, size = Bench(settings), settings.size
    prefixes = {n: bench.stages(size)[:n] for n in range(1, len(PROGRAMS) + 1)}
    taken, failures = measuring.alternate(
        {n: lambda n=n: bench.run(prefixes[n]) for n in prefixes}, settings.repeats
    )
    topic = Topic(
        "stages",
        "One stage after another",
        f"Pipelines that end after each stage, their output thrown away; {size}, {measuring.cores()} cores.",
        ["up to", "clock, s", "CPU of all, s", "more clock, s"],
        plots={"stages": []},
    )
    before = 0.0
    for n, run in taken.items():
        topic.rows.append([PROGRAMS[n - 1], figures(run.clock_s), figures(run.cpu_s), f"{run.clock_s - before:+.3f}"])
        before = run.clock_s
    topic.missing({f"{n} stages": problem for n, problem in failures.items()})
    return topic


def threads(settings):
    """Single programs on more threads."""
    bench, size = Bench(settings), settings.size
    at, ramp = bench.folder, ramp_file(bench, size)
    bench.run([[BIN / "digitize", ramp, "-q", "-o", at / "codes.tiff"]])
    calls = {
        "add-noise": [ramp, "-o", at / "noisy.exr"],
        "demosaic": [at / "codes.tiff", "--method", "eci", "-o", at / "rgb.exr"],
    }
    numbers = [n for n in (1, 2, 4, 8, 16, 32) if n <= measuring.cores()]

    def run(name, number):
        return lambda: bench.run([[BIN / name, *calls[name], "--threads", number, "-q"]])

    taken, failures = measuring.alternate(
        {(name, number): run(name, number) for name in calls for number in numbers}, settings.repeats
    )
    topic = Topic(
        "threads",
        "Threads",
        f"Single programs from file to file with `--threads`, {size}, clock; demosaic by ECI.",
        ["program", "threads", "clock, s", "CPU, s", "times as fast as one"],
        plots={name: [] for name in calls},
    )
    for (name, number), run_of in taken.items():
        single = taken.get((name, 1))
        gain = single.clock_s / run_of.clock_s if single else float("nan")
        topic.rows.append([name, number, figures(run_of.clock_s), figures(run_of.cpu_s), figures(gain)])
        topic.plots[name].append([number, gain])
    topic.missing({f"{name} on {number}": problem for (name, number), problem in failures.items()})
    return topic
