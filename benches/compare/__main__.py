"""Measures programs, pipelines and kernels beside peers, in turns, and writes a page with tables and plots.

Run by scripts/bench, which builds what is measured and installs the peers.
"""

import argparse
import datetime
import importlib.metadata
import pathlib
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass

import kernels
import leaving_out
import measuring
import programs

PARTS = {
    "noise": kernels.noise,
    "demosaic": kernels.demosaic,
    "matrix": kernels.matrix,
    "copy": kernels.copy,
    "spectral": kernels.spectral,
    "programs": programs.programs,
    "pipeline": programs.pipeline,
    "pixels": programs.pixels,
    "stages": programs.stages,
    "threads": programs.threads,
    "leave_out": leaving_out.leave_out,
}
PACKAGES = ["numpy", "colour-science", "colour-demosaicing", "opencv-python-headless", "rawpy", "pyxel-sim"]


@dataclass
class Settings:
    quick: bool
    repeats: int
    size: str
    folder: pathlib.Path


def arguments():
    parser = argparse.ArgumentParser(prog="scripts/bench", description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="NAME", action="append", choices=PARTS, help=f"one part: {', '.join(PARTS)}")
    parser.add_argument("--quick", action="store_true", help="smaller frames, three runs each, nothing above 10 Mpix")
    parser.add_argument("--repeats", type=int, metavar="N", help="runs of each, an odd number; 5, or 3 with --quick")
    parser.add_argument(
        "--output",
        type=pathlib.Path,
        metavar="DIRECTORY",
        help="where benchmarks.md and benchmarks/ go; docs for a full run, else target/bench",
    )
    chosen = parser.parse_args()
    if chosen.repeats is not None and (chosen.repeats < 1 or chosen.repeats % 2 == 0):
        parser.error("--repeats must be odd, so that there is a median run")
    return chosen


def machine():
    """Processor, cores, memory, system."""
    name, flags = platform.processor() or platform.machine(), set()
    cpuinfo = pathlib.Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                name = value.strip()
            elif key.strip() == "flags":
                flags = set(value.split())
    vectors = [flag for flag in ("sse2", "avx2", "avx512f", "avx512bw", "avx512dq", "avx512vl") if flag in flags]
    meminfo = pathlib.Path("/proc/meminfo")
    memory = ""
    if meminfo.exists():
        memory = f", {int(meminfo.read_text(encoding='utf-8').split()[1]) / 1024**2:.0f} GiB of memory"
    used = ", ".join(kernels.instruction_sets())
    return [
        f"{name}, {measuring.cores()} cores{memory}, {platform.system()} {platform.release().split('-')[0]}",
        f"instruction sets of the processor: {', '.join(vectors) or 'not known'}; ours by name: {used}",
    ]


def versions():
    ours = subprocess.run([measuring.BIN / "add-noise", "--version"], check=True, capture_output=True, text=True).stdout
    describe = ["git", "describe", "--always", "--dirty"]
    revision = subprocess.run(describe, capture_output=True, text=True, cwd=measuring.ROOT)
    rust = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout
    lines = [f"cyanometer {ours.split()[2]} ({revision.stdout.strip() or 'no revision'}), {' '.join(rust.split()[:2])}"]
    found = []
    for package in PACKAGES:
        try:
            found.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            found.append(f"{package} not installed")
    return lines + [f"Python {platform.python_version()}, {', '.join(found)}"]


def page(topics, drawn, settings, command):
    """The page as Markdown."""
    lines = [
        "# Benchmarks",
        "",
        f"Made by `{command}` on {datetime.date.today():%-d %B %Y}; each table alone by the command below it. "
        "Do not edit: run it again.",
        "",
        *(f"- {line}" for line in machine() + versions()),
        "",
        f"Ours and peers take turns, run by run; figures are medians (runs of each: {settings.repeats}), ratios those of the "
        "medians; peaks of memory are the largest. Ratios above 1 mean that ours is faster. Speeds are those of one machine "
        "at one time: compare within a table only. Peers run as they install, without settings of their own; what each "
        "does stands in `benches/peers`. Kernels in memory are also timed by `cargo bench`.",
        "",
    ]
    if settings.quick:
        lines += ["**A quick run, to see that all works: smaller frames and few runs. Its figures are not to be quoted.**", ""]
    for index, topic in enumerate(topics):
        lines.append(topic.markdown())
        last_of_name = all(later.name != topic.name for later in topics[index + 1 :])
        if last_of_name:
            for file, caption in drawn.get(topic.name, []):
                lines += [f"![{caption}](benchmarks/{file})", "", f"*{caption}.*", ""]
            lines += [f"`scripts/bench --only {topic.name}`", ""]
    return "\n".join(lines).rstrip() + "\n"


def draw(topics, folder):
    try:
        import plots
    except ImportError as problem:
        print(f"bench: no plots: {problem}", file=sys.stderr)
        return {}
    return plots.draw(topics, folder)


def main():
    chosen = arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("bench: stopped"))
    whole = not chosen.only and not chosen.quick
    output = chosen.output or (measuring.ROOT / "docs" if whole else measuring.ROOT / measuring.TARGET / "bench")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="bench-", dir=measuring.ROOT / measuring.TARGET))
    repeats = chosen.repeats or (3 if chosen.quick else 5)
    settings = Settings(chosen.quick, repeats, "1332x1000" if chosen.quick else "2654x1996", folder)
    topics = []
    try:
        for name in chosen.only or PARTS:
            print(f"{name} …", file=sys.stderr, flush=True)
            made = PARTS[name](settings)
            made = made if isinstance(made, list) else [made]
            for topic in made:
                print(topic.markdown(), flush=True)
            topics += made
            for file in folder.iterdir():
                file.unlink()
    finally:
        shutil.rmtree(folder)
    output.mkdir(parents=True, exist_ok=True)
    first = {topic.name: topic for topic in reversed(topics)}
    drawn = draw(first, output / "benchmarks")
    command = " ".join(["scripts/bench", *sys.argv[1:]])
    (output / "benchmarks.md").write_text(page(topics, drawn, settings, command), encoding="utf-8")
    print(f"Written: {output / 'benchmarks.md'}", file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except (measuring.Failed, subprocess.CalledProcessError) as problem:
        sys.exit(f"bench: {problem}")
