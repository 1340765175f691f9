"""What `measure` says of a range of frames, as a row for each frame."""

import pathlib

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet

from . import files

CHANNELS = {"adu": "RGB", "demosaicked": "RGB", "xyz": "XYZ", "lab": "Lab"}
UNITS = {"adu": "adu", "demosaicked": "adu", "xyz": "cd_per_m2", "lab": ""}
WITH_UNIT = ("mean", "std", "min", "max", "predicted_mean", "predicted_std", "mean_error", "std_error")
STATISTICS = (
    "count", "clipped", "mean", "std", "min", "max", "snr_db", "predicted_mean", "predicted_std", "mean_error",
    "std_error", "z_mean", "z_std",
)  # fmt: skip
WHOLE = {"count", "clipped"}


def statistics(stage: str) -> list[str]:
    """The statistics of a stage; behind the converter it is the count that tells what was left out."""
    return [name for name in STATISTICS if name != "clipped" or stage == "adu"]


def column(stage: str, channel: str, statistic: str) -> str:
    """The column of a statistic, with its unit."""
    unit = UNITS[stage] if statistic in WITH_UNIT else ""
    return "_".join(filter(None, [stage, channel, statistic, unit]))


def schema(stages: tuple[str, ...]) -> pa.Schema:
    """Columns of a range of frames."""
    fields = [pa.field("frame", pa.int64(), nullable=False)]
    for stage in stages:
        for channel in CHANNELS[stage]:
            for name in statistics(stage):
                fields.append(pa.field(column(stage, channel, name), pa.int64() if name in WHOLE else pa.float64()))
    return pa.schema(fields)


def read(directory: pathlib.Path, stages: tuple[str, ...], frames: range) -> pa.Table:
    """Makes a row for each frame of the reports `STAGE.csv`; a report that lacks a frame, or has another, is refused."""
    columns: dict[str, pa.Array] = {"frame": pa.array(frames, pa.int64())}
    for stage in stages:
        path = directory / f"{stage}.csv"
        types = {name: pa.int64() if name in WHOLE else pa.float64() for name in STATISTICS}
        convert = pa.csv.ConvertOptions(
            column_types={**types, "channel": pa.string(), "frame": pa.int64(), "file": pa.string()}
        )
        report = pa.csv.read_csv(path, convert_options=convert)
        for channel in CHANNELS[stage]:
            of_channel = report.filter(pa.compute.equal(report["channel"], channel))
            if of_channel["frame"].to_pylist() != list(frames):
                raise ValueError(
                    f"{path}: channel {channel} has not the frames {frames.start}..{frames.stop} in their order"
                )
            for name in statistics(stage):
                columns[column(stage, channel, name)] = of_channel[name].combine_chunks()
    return pa.table(columns, schema=schema(stages))


def write(table: pa.Table, path: pathlib.Path) -> None:
    """Writes a range of frames, as a whole or not at all."""
    with files.complete(path) as part:
        pa.parquet.write_table(table, part, compression="zstd", use_dictionary=False)
