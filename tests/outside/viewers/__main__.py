"""Makes frames of every stage, opens each in the viewers that are installed, and says what they show. See docs/viewers.md."""

import argparse
import pathlib
import subprocess
import sys

import numpy as np

from conformance.__main__ import BEGIN, END
from conformance.converters import Refused, call

from . import frames
from .viewers import VIEWERS

# Mean distance of patches, as a share of full scale, up to which two pictures are the same: two of 8 bits' 255 levels for
# rounding and dithering, and what converters' own working spaces lose.
SAME = 3 / 255

# What `timeout` ends with where it stopped a program.
TIMED_OUT = 124


def main():
    parser = argparse.ArgumentParser(prog="viewers", description=__doc__)
    parser.add_argument("directory", nargs="?", type=pathlib.Path, default=pathlib.Path("viewers-output"))
    parser.add_argument("--document", metavar="FILE", type=pathlib.Path, help="page whose table is replaced")
    settings = parser.parse_args()
    directory = settings.directory.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    viewers = [viewer for viewer in VIEWERS if viewer.version() and not viewer.lacks()]
    for viewer in VIEWERS:
        if viewer not in viewers:
            why = f"is run by {', '.join(viewer.lacks())}, which is missing" if viewer.version() else "is not installed"
            print(f"{viewer.name} {why}: it is left out", file=sys.stderr)
    lines = []
    with (directory / "table.md").open("w", encoding="utf-8") as file:
        # Rows as they come: a viewer that hangs, or an end by hand, keeps those before.
        for line in table(viewers, frames.make_all(directory), directory):
            lines.append(line)
            print(line, flush=True)
            print(line, file=file, flush=True)
    page = "\n".join(lines)
    if settings.document:
        text = settings.document.read_text(encoding="utf-8")
        before, after = text.split(BEGIN)[0], text.split(END)[1]
        settings.document.write_text(before + BEGIN + "\n" + page + "\n" + END + after, encoding="utf-8")


def shown(viewer, frame, directory):
    """What a viewer shows of a frame, in words."""
    if frame.path.suffix[1:] not in viewer.formats:
        return "–"
    picture = directory / f"{frame.path.stem}-{frame.path.suffix[1:]}-{viewer.name}.png"
    picture.unlink(missing_ok=True)
    hangs = False  # Which says nothing of the file.
    try:
        call(viewer.command(frame.path, picture), directory)
    except Refused as refused:
        print(f"{viewer.name}, {frame.path.name}: {refused}", file=sys.stderr)
        hangs = refused.status == TIMED_OUT
    except subprocess.TimeoutExpired as late:
        print(f"{viewer.name}, {frame.path.name}: no answer in {late.timeout:.0f} s", file=sys.stderr)
        hangs = True
    if not picture.exists():
        return "no answer" if hangs else "refused"
    seen = frames.patches_of_file(directory, picture.name)
    if seen.shape != frame.readings["as preview"].shape:
        return "another size"
    if seen.mean() < 0.07 and seen.max() < 0.1:
        return "black"
    if seen.mean() > 0.97:
        return "white"
    distances = {name: float(np.abs(seen - reading).mean()) for name, reading in frame.readings.items()}
    nearest = min(distances, key=distances.get)
    if distances[nearest] < SAME:
        return nearest
    return f"other ({nearest} {distances[nearest]:.3f})"


def table(viewers, made, directory):
    """The lines of the table, each as soon as its frame was shown."""
    heads = ["frame", *(f"{viewer.name} {viewer.version()}" for viewer in viewers)]
    yield "| " + " | ".join(heads) + " |"
    yield "|" + " --- |" * len(heads)
    for frame in made:
        name = f"{frame.words}, {frame.path.suffix[1:].upper()}{', `--viewable`' if frame.viewable else ''}"
        yield "| " + " | ".join([name, *(shown(viewer, frame, directory) for viewer in viewers)]) + " |"


if __name__ == "__main__":
    main()
