"""The steps of a sweep that are no program of cyanometer; the Snakefile runs them, with the sweep's YAML first.

steps.py SWEEP part DIRECTORY PART     the reports in a directory as a range of frames
steps.py SWEEP kept DIRECTORY LIST     BLAKE3 of the frames that a job kept
steps.py SWEEP table                   table and summary of all ranges
steps.py SWEEP plots                   figures of the summary
steps.py SWEEP checksums               BLAKE3 of all results, as `b3sum --check` reads it
"""

import os
import pathlib
import re
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from sweep import files, plan, reports, summary, table
from sweep.mistakes import Mistakes


def _frames(name: str) -> range:
    """The range in the name of a file."""
    found = re.search(r"(\d+)-(\d+)\.\w+$", name)
    assert found is not None
    return range(int(found[1]), int(found[2]))


def part(planned: plan.Plan, directory: str, name: str) -> None:
    """Turns reports into a range of frames."""
    reports.write(reports.read(pathlib.Path(directory), planned.sweep.stages, _frames(name)), pathlib.Path(name))


def kept(planned: plan.Plan, directory: str, name: str) -> None:
    """Lists the frames that a job kept, and their sidecars."""
    assert planned.sweep.keep is not None
    stage, lines = planned.sweep.keep.stage, []
    for number in _frames(name):
        for ending in ("exr", "exr.yaml"):
            path = pathlib.Path(directory) / f"{stage}-{number:010}.{ending}"
            lines.append(f"{files.digest(path)}  {_beside(planned, path)}\n")
    _write(name, "".join(lines))


def make_table(planned: plan.Plan) -> None:
    """Writes the table, and in the same pass the summary."""
    rows: list[dict[str, Any]] = []

    def tables() -> Iterator[pa.Table]:
        for condition in planned.conditions:
            said = table.predicted(planned, condition)
            gathered = summary.OfCondition(planned, condition, said)
            for block in table.blocks(planned, condition):
                gathered.add(block)
                yield table.rows(planned, condition, block, said)
            rows.extend(gathered.rows())

    table.write(planned.table, table.schema(planned), tables())
    judged = summary.judged(rows)
    table.write(planned.summary, summary.schema(), iter([judged]))
    verdicts = judged["holds"].to_pylist()
    wrong, without = verdicts.count(False), verdicts.count(None)
    print(
        f"{len(verdicts) - without} predictions tested, {wrong} do not hold; {without} without a test (saturated, or without a prediction)",
        file=sys.stderr,
    )


def draw_plots(planned: plan.Plan) -> None:
    """Draws the figures."""
    from sweep import plots  # noqa: PLC0415, matplotlib takes a second to start

    if planned.summary.endswith(".parquet"):
        rows = pa.parquet.read_table(planned.summary)
    else:
        convert = pa.csv.ConvertOptions(column_types=summary.schema(), strings_can_be_null=True)
        rows = pa.csv.read_csv(planned.summary, convert_options=convert)
    plots.draw(rows, planned.plots)


def checksums(planned: plan.Plan) -> None:
    """Writes BLAKE3 of table, summary, figures and kept frames, by names beside the file itself."""
    results = [planned.table, planned.summary, *planned.plots.values()]
    lines = [f"{files.digest(pathlib.Path(name))}  {_beside(planned, pathlib.Path(name))}\n" for name in results]
    for name in planned.kept_parts():
        lines.append(pathlib.Path(name).read_text())
    _write(planned.checksums, "".join(lines))


def _beside(planned: plan.Plan, path: pathlib.Path) -> str:
    return os.path.relpath(path, pathlib.Path(planned.table).parent)


def _write(name: str, text: str) -> None:
    with files.complete(pathlib.Path(name)) as complete:
        complete.write_text(text)


def main() -> int:
    """Runs a step; mistakes are told without a traceback."""
    sweep, step, *arguments = sys.argv[1:]
    steps: dict[str, Callable[..., None]] = {
        "part": part, "kept": kept, "table": make_table, "plots": draw_plots, "checksums": checksums,
    }  # fmt: skip
    try:
        steps[step](plan.read(sweep), *arguments)
    except (Mistakes, ValueError, OSError) as error:
        print(f"steps.py {step}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
