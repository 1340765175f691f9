"""Figures of the summary, as SVG or PNG."""

import math
import pathlib
from typing import Any

import matplotlib
import pyarrow as pa

from . import files, reports

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "cyanometer"  # so that an SVG has the same bytes each time
from matplotlib import pyplot, ticker  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

Row = dict[str, Any]
COLORS = {"R": "#c1272d", "G": "#2e8b57", "B": "#2a52be", "X": "#c1272d", "Y": "#2e8b57", "Z": "#2a52be"} | {
    "L": "#444444", "a": "#b8388c", "b": "#c8951a"
}  # fmt: skip
MARKS = "osD^v<>phX"
NAMED = 24  # conditions that an axis can name
TICKS = 8  # exposure times that an axis can name


def draw(summary: pa.Table, plots: dict[str, str]) -> None:
    """Draws the figures that are asked for, each with its file."""
    rows = summary.to_pylist()
    drawn = {"spread": spread, "snr": snr, "color-error": color_error}
    for name, path in plots.items():
        figure = drawn[name](rows)
        with files.complete(pathlib.Path(path)) as part:
            kind = pathlib.Path(path).suffix[1:]
            metadata = {"Date": None} if kind == "svg" else {"Software": None}
            figure.savefig(part, format=kind, dpi=150, metadata=metadata)
        pyplot.close(figure)


def spread(rows: list[Row]) -> Figure:
    """Measured over predicted standard deviation by condition, with one standard error."""
    stages = list(dict.fromkeys(row["stage"] for row in rows))
    conditions = {row["condition"]: _label(row, rows) for row in rows}
    named = len(conditions) <= NAMED
    width = min(16.0, max(6.4, 2.5 + 0.45 * len(conditions)))
    longest = max(map(len, conditions.values())) if named else 0
    figure, axes = pyplot.subplots(
        len(stages),
        1,
        sharex=True,
        squeeze=False,
        layout="constrained",
        figsize=(width, 1.9 * len(stages) + 0.8 + 0.07 * longest),
    )
    for axis, stage in zip(axes[:, 0], stages, strict=True):
        for offset, channel in zip((-0.2, 0, 0.2), reports.CHANNELS[stage], strict=True):
            chosen = [r for r in rows if r["stage"] == stage and r["channel"] == channel and r["variance_ratio"] is not None]
            ratios = [math.sqrt(row["variance_ratio"]) for row in chosen]
            # Of a root, the relative error is half as large.
            errors = [
                ratio * row["variance_ratio_error"] / row["variance_ratio"] / 2
                for ratio, row in zip(ratios, chosen, strict=True)
            ]
            at = [row["condition"] + offset for row in chosen]
            axis.errorbar(at, ratios, errors, fmt="o", ms=3, capsize=2, lw=1, color=COLORS[channel], label=channel)
            lost = [(x, ratio) for x, ratio, row in zip(at, ratios, chosen, strict=True) if row["p"] is None]
            if lost:
                axis.plot(
                    *zip(*lost, strict=True), "x", ms=8, color="black", label="saturated" if channel in "BZb" else None
                )
        axis.axhline(1, color="gray", lw=0.8, zorder=0)
        axis.set_ylabel(f"{stage}\nstd / predicted")
        axis.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize="small", frameon=False)
    last = axes[-1, 0]
    if named:
        last.set_xticks(list(conditions), list(conditions.values()), rotation=90, fontsize="x-small")
    else:
        last.set_xlabel("condition")
    axes[0, 0].set_title("Measured over predicted standard deviation, ± 1 standard error", fontsize="medium")
    return figure


def snr(rows: list[Row]) -> Figure:
    """Signal-to-noise ratio of green codes against the exposure time, by sensor; lines are predicted."""
    stage = "adu" if any(row["stage"] == "adu" for row in rows) else rows[0]["stage"]
    channel = reports.CHANNELS[stage][1]
    chosen = [row for row in rows if row["stage"] == stage and row["channel"] == channel]
    curves: dict[str, tuple[list[Row], list[float | None], list[float | None]]] = {}
    # What a method makes of the codes does not matter to them.
    per_method = stage != "adu"
    for row in _one_a_method(chosen, per_method):
        of_curve, measured, predicted = curves.setdefault(_curve(row, chosen, per_method), ([], [], []))
        of_curve.append(row)
        measured.append(row["snr_db"])
        predicted.append(row["predicted_snr_db"])
    return _against_exposure(curves, f"SNR of {stage} {channel} / dB", "Signal to noise within a frame")


def color_error(rows: list[Row]) -> Figure:
    """Color error that noise makes at a pixel, against the exposure time; lines are predicted."""
    by_condition: dict[int, list[Row]] = {}
    for row in rows:
        if row["stage"] == "lab":
            by_condition.setdefault(row["condition"], []).append(row)
    firsts = [found[0] for found in by_condition.values()]
    curves: dict[str, tuple[list[Row], list[float | None], list[float | None]]] = {}
    for found in by_condition.values():
        of_curve, measured, predicted = curves.setdefault(_curve(found[0], firsts, True), ([], [], []))
        of_curve.append(found[0])
        measured.append(_distance([row["std"] for row in found]))
        predicted.append(_distance([row["predicted_std"] for row in found]))
    return _against_exposure(curves, "ΔE*ab, root mean square", "Color error that noise makes at a pixel", logarithmic=True)


def _distance(sides: list[float | None]) -> float | None:
    known = [side for side in sides if side is not None]
    return math.hypot(*known) if len(known) == len(sides) else None


def _against_exposure(
    curves: dict[str, tuple[list[Row], list[float | None], list[float | None]]],
    what: str,
    title: str,
    *,
    logarithmic: bool = False,
) -> Figure:
    """Measured points over predicted lines; sensors have colors, other settings have marks."""
    figure, axis = pyplot.subplots(layout="constrained", figsize=(8, 4.8))
    sensors = list(dict.fromkeys(rows[0]["sensor"] for rows, _, _ in curves.values()))
    for number, (label, (rows, measured, predicted)) in enumerate(curves.items()):
        color = f"C{sensors.index(rows[0]['sensor']) % 10}" if len(sensors) > 1 else f"C{number % 10}"
        points = sorted(zip((row["exposure_s"] for row in rows), measured, predicted, strict=True))
        for values, style in ((2, "-"), (1, MARKS[number % len(MARKS)])):
            pairs = [(point[0], point[values]) for point in points if point[values] is not None]
            if pairs:
                named = label if values == 1 else None
                axis.plot(*zip(*pairs, strict=True), style, color=color, lw=0.8, ms=4.5, mfc="none", label=named)
    axis.set_xscale("log")
    exposures = sorted({row["exposure_s"] for rows, _, _ in curves.values() for row in rows})
    if len(exposures) <= TICKS:
        axis.set_xticks(exposures, [f"{exposure:.3g}" for exposure in exposures])
        axis.set_xticks([], minor=True)
    if logarithmic:
        axis.set_yscale("log")
        for set_formatter in (axis.yaxis.set_major_formatter, axis.yaxis.set_minor_formatter):
            set_formatter(ticker.LogFormatter(labelOnlyBase=False, minor_thresholds=(1.5, 0.5)))
    axis.set_xlabel("exposure time / s")
    axis.set_ylabel(what)
    axis.set_title(f"{title}: points measured, lines predicted", fontsize="medium")
    axis.grid(which="both", color="#eeeeee")
    if len(curves) <= NAMED:
        axis.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize="x-small", frameon=False)
    return figure


def _one_a_method(rows: list[Row], per_method: bool) -> list[Row]:
    first = rows[0]["method"] if rows else None
    return [row for row in rows if per_method or row["method"] == first]


def _curve(row: Row, rows: list[Row], per_method: bool) -> str:
    """What tells a curve from the others: settings that vary, but the exposure."""
    axes = ["sensor", "temperature_k", "sky"] + (["method"] if per_method else [])
    return _named(row, rows, axes) or row["sensor"]


def _label(row: Row, rows: list[Row]) -> str:
    """What tells a condition from the others."""
    exposure = "exposure_s" if row["expose_to"] is None else "expose_to"
    return _named(row, rows, ["sensor", exposure, "temperature_k", "sky", "method"]) or row["sensor"]


def _named(row: Row, rows: list[Row], axes: list[str]) -> str:
    units = {"exposure_s": " s", "temperature_k": " K", "expose_to": " of full well"}
    told = []
    for axis in axes:
        # Sensors that have their own temperatures are told apart by their names.
        beside = [other for other in rows if axis != "temperature_k" or other["sensor"] == row["sensor"]]
        if len({other[axis] for other in beside}) > 1:
            value = row[axis]
            told.append(f"{value:.4g}{units[axis]}" if isinstance(value, float) else str(value))
    return ", ".join(told)
