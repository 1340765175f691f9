"""The ranges of all conditions as one table.

The bytes hang on the rows alone: a group of rows has ROWS frames of one condition however the ranges were cut.
"""

import json
import pathlib
from collections.abc import Iterator
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from . import files, reports
from .conditions import Condition
from .plan import Plan

ROWS = 10_000


def settings(plan: Plan, condition: Condition, predicted: dict[str, Any]) -> dict[str, Any]:
    """What was set for a condition, by column; time and temperature as the programs say that they were."""
    sweep = plan.sweep
    electrons = dict(zip("RGB", predicted["electrons"], strict=True))
    return {
        "condition": condition.number,
        "sensor": condition.sensor.name,
        "exposure_s": float(predicted["exposure_s"]),
        "expose_to": condition.expose_to,
        "temperature_k": float(predicted["temperature_k"]),
        "sky": condition.sky.name,
        "method": condition.method,
        "f_number": float(predicted["f_number"]),
        "lens_transmittance": sweep.lens_transmittance,
        "width": sweep.width,
        "height": sweep.height,
        **{f"expected_{channel}_e": float(value) for channel, value in electrons.items()},
        "seed": condition.seed,
        "sensor_seed": sweep.sensor_seed,
    }


SETTINGS = pa.schema(
    [
        ("condition", pa.int64()), ("sensor", pa.string()), ("exposure_s", pa.float64()), ("expose_to", pa.float64()),
        ("temperature_k", pa.float64()), ("sky", pa.string()), ("method", pa.string()), ("f_number", pa.float64()),
        ("lens_transmittance", pa.float64()), ("width", pa.int64()), ("height", pa.int64()),
        ("expected_R_e", pa.float64()), ("expected_G_e", pa.float64()), ("expected_B_e", pa.float64()),
        ("seed", pa.int64()), ("sensor_seed", pa.int64()),
    ]
)  # fmt: skip


def predicted(plan: Plan, condition: Condition) -> dict[str, Any]:
    """What predict-noise says of a condition."""
    found: dict[str, Any] = json.loads(pathlib.Path(plan.predicted(condition)).read_text())
    return found


def schema(plan: Plan) -> pa.Schema:
    """Columns of the table: what was set, the frame, what was measured."""
    return pa.schema([*SETTINGS, *reports.schema(plan.sweep.stages)])


def blocks(plan: Plan, condition: Condition) -> Iterator[pa.Table]:
    """The measured frames of a condition, ROWS at a time."""
    waiting: list[pa.Table] = []
    count = 0
    for path in plan.parts(condition):
        part = pa.parquet.read_table(path, schema=reports.schema(plan.sweep.stages))
        waiting.append(part)
        count += part.num_rows
        while count >= ROWS:
            joined = pa.concat_tables(waiting)
            yield joined.slice(0, ROWS).combine_chunks()
            waiting, count = [joined.slice(ROWS)], count - ROWS
    if count:
        yield pa.concat_tables(waiting).combine_chunks()


def rows(plan: Plan, condition: Condition, block: pa.Table, found: dict[str, Any]) -> pa.Table:
    """Rows of the table: a block with what was set in front."""
    values = settings(plan, condition, found)
    front = [pa.array([values[field.name]] * block.num_rows, field.type) for field in SETTINGS]
    return pa.table([*front, *block.columns], schema=schema(plan))


class Writer:
    """Writes tables one after another as Parquet or, by the name, as CSV."""

    def __init__(self, name: str, path: pathlib.Path, columns: pa.Schema) -> None:
        self._parquet = name.endswith(".parquet")
        if self._parquet:
            repeated = [
                f.name for f in columns if not pa.types.is_floating(f.type) or "predicted" in f.name or f in SETTINGS
            ]
            split = {field.name: "BYTE_STREAM_SPLIT" for field in columns if field.name not in repeated}
            self._writer: Any = pa.parquet.ParquetWriter(
                path, columns, compression="zstd", use_dictionary=repeated, column_encoding=split or None
            )
        else:
            self._writer = pa.csv.CSVWriter(path, columns, write_options=pa.csv.WriteOptions(quoting_style="needed"))

    def write(self, table: pa.Table) -> None:
        if self._parquet:
            self._writer.write_table(table, row_group_size=ROWS)
        else:
            self._writer.write_table(table)

    def close(self) -> None:
        self._writer.close()


def write(name: str, columns: pa.Schema, tables: Iterator[pa.Table]) -> None:
    """Writes a file, as a whole or not at all."""
    with files.complete(pathlib.Path(name)) as part:
        writer = Writer(name, part, columns)
        for table in tables:
            writer.write(table)
        writer.close()
