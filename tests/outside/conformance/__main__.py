"""Makes the set, runs what converters are installed, and writes the tables. See docs/conformance.md."""

import argparse
import pathlib
import shutil
import sys

from programs import BINARIES

from . import build, compare, report
from .converters import call, converters, rawpy

BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"


def main():
    parser = argparse.ArgumentParser(prog="conformance", description=__doc__)
    parser.add_argument("directory", nargs="?", type=pathlib.Path, default=pathlib.Path("conformance-output"))
    parser.add_argument("--set-only", action="store_true", help="make the files alone")
    parser.add_argument("--only", metavar="WORD", default="", help="files whose name has this word")
    parser.add_argument("--document", metavar="FILE", type=pathlib.Path, help="page whose table is replaced")
    settings = parser.parse_args()
    directory = settings.directory.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    files = [file for file in build.FILES if settings.only in file.name]
    if not files:
        sys.exit(f"conformance: no file of the set has `{settings.only}` in its name")

    truths = build.make_all(directory, lambda command: call([BINARIES / command[0], *command[1:]], directory), files)
    shutil.copy(pathlib.Path(__file__).with_name("readme.md"), directory / "README.md")
    print(f"{len(files)} files in {settings.directory}")
    if settings.set_only:
        return
    page, *numbers = examine(directory, files, truths)
    report.write(directory, page, *numbers)
    if settings.document:
        text = settings.document.read_text(encoding="utf-8")
        before, after = text.split(BEGIN)[0], text.split(END)[1]
        settings.document.write_text(before + BEGIN + "\n" + page + "\n" + END + after, encoding="utf-8")
    print(f"table.md, results.csv and results.json in {settings.directory}")


def examine(directory, files, truths):
    """Runs all that is there; gives the page and its numbers."""
    known = converters(BINARIES)
    versions = {converter.name: converter.version() for converter in known}
    for name in (name for name, version in versions.items() if not version):
        print(f"{name} is not installed, and left out")
    results, differences, noises = {}, {}, {}
    for file in files:
        path, truth = directory / f"{file.name}.dng", truths[file.name]
        differences[file.name] = compare.wrong_tags(path, build.expected_tags(file, truth))
        if rawpy:
            differences[file.name] += ["LibRaw: " + text for text in compare.libraw_differences(truth, path)]
        for converter in (converter for converter in known if versions[converter.name]):
            results[file.name, converter.name] = compare.compare(converter, truth, path)
        if file.noisy:
            noises[file.name] = compare.noise(truth, path)
    warnings = compare.exiftool_warnings([directory / f"{file.name}.dng" for file in files])
    page = report.markdown([c.name for c in known], versions, results, files, differences, warnings, noises)
    return page, results, noises, versions


if __name__ == "__main__":
    main()
