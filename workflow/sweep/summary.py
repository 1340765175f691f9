"""A row for each condition, stage and channel: what was measured over all frames, beside what was predicted, and tests.

Frames of one sensor share its fixed patterns, so that their statistics are not independent: however many frames there are,
there is one pattern. With phi the share of the predicted variance that is fixed, N frames, and e1 the standard error of one
frame's statistic (that of `measure`, which counts correlated pixels):

    mean       e^2 = e1^2 (phi + (1 - phi)/N)
    variance   e^2 = e1^2 (phi^2 + (1 - phi^2)/N)      relative; e1^2 = 2/nu1

For S^2 = S_FF + 2 S_FT + S_TT of a fixed pattern F and temporal noise T, which are white alike, the three have relative
variances (2/nu1) phi^2, (2/nu1) 2 phi (1 - phi) and (2/nu1) (1 - phi)^2, of which the first is common to all frames. A mean
is tested by z, a variance by chi-square with nu = 2/e^2 degrees of freedom, by Wilson and Hilferty's cube root. Of n pixels
that are alike with their neighbors the variance about the frame's own mean is expected to be

    E s^2 = n/(n - 1) (sigma^2 - e1^2)      e1 that of the mean

which is what a measured variance is divided by. Here e1 is that of an endless plane: in a region of w x h demosaicked pixels the
outermost are alike with others outside, so that its mean scatters less, by up to the share REACH (1/w + 1/h), and s^2 more.
A ratio between the two is as predicted; in a region of few pixels they differ by per cents.
"""

import dataclasses
import math
from typing import Any

import pyarrow as pa

from . import reports, table
from .conditions import Condition
from .plan import Plan

REACH = 2  # pixels to which one is alike, more than the mean of distances weighted by correlations, which is about 1
LEVEL = 1e-4  # chance of a false alarm, all tests of a sweep together

MEASURED = pa.schema(
    [
        ("frames", pa.int64()), ("stage", pa.string()), ("channel", pa.string()), ("unit", pa.string()),
        ("mean", pa.float64()), ("mean_error", pa.float64()), ("mean_spread", pa.float64()),
        ("predicted_mean", pa.float64()), ("z_mean", pa.float64()),
        ("std", pa.float64()), ("predicted_std", pa.float64()), ("predicted_fixed_share", pa.float64()),
        ("variance_ratio", pa.float64()), ("variance_ratio_error", pa.float64()), ("variance_ratio_spread", pa.float64()),
        ("variance_ratio_predicted_spread", pa.float64()), ("z_variance", pa.float64()),
        ("snr_db", pa.float64()), ("predicted_snr_db", pa.float64()),
        ("clipped", pa.int64()), ("left_out", pa.int64()), ("p", pa.float64()), ("holds", pa.bool_()),
    ]
)  # fmt: skip


def schema() -> pa.Schema:
    """Columns of the summary."""
    return pa.schema([*table.SETTINGS, *MEASURED])


@dataclasses.dataclass
class Moments:
    """Number, mean and sum of squared deviations of what came; sums are exact, so that they hang on no machine."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, values: list[float]) -> None:
        """Takes a block of values."""
        if not values:
            return
        mean = math.fsum(values) / len(values)
        squares = math.fsum((value - mean) ** 2 for value in values)
        count = self.count + len(values)
        away = mean - self.mean
        self.squares += squares + away * away * self.count * len(values) / count
        self.mean += away * len(values) / count
        self.count = count

    @property
    def spread(self) -> float | None:
        """Standard deviation of the values."""
        return math.sqrt(self.squares / (self.count - 1)) if self.count > 1 else None


@dataclasses.dataclass
class Gathered:
    """What came of one channel of a stage, frame by frame."""

    mean: Moments = dataclasses.field(default_factory=Moments)
    variance: Moments = dataclasses.field(default_factory=Moments)
    snr_db: Moments = dataclasses.field(default_factory=Moments)
    frames: int = 0
    pixels: int = 0
    clipped: int = 0
    left_out: int = 0
    predicted: tuple[float, float] | None = None
    errors: tuple[float, float] | None = None

    def add(self, stage: str, channel: str, block: pa.Table, pixels: int) -> None:
        """Takes a block of frames."""

        def values(statistic: str) -> list[Any]:
            found: list[Any] = block[reports.column(stage, channel, statistic)].to_pylist()
            return found

        def known(statistic: str) -> list[Any]:
            return [value for value in values(statistic) if value is not None]

        self.frames += block.num_rows
        self.pixels = pixels
        self.mean.add(known("mean"))
        self.variance.add([std * std for std in known("std")])
        self.snr_db.add(known("snr_db"))
        self.left_out += sum(pixels - count for count in values("count"))
        self.clipped += sum(known("clipped")) if stage == "adu" else 0
        for first in zip(*map(values, ("predicted_mean", "predicted_std", "mean_error", "std_error", "std")), strict=True):
            if self.predicted is None and None not in first and first[4] > 0:
                self.predicted = first[:2]
                self.errors = (first[2] / first[4], first[3] / first[4])


def cube_root_z(ratio: float, degrees: float) -> float:
    """The normal deviate of a variance over its expectation, by Wilson and Hilferty."""
    share = 2 / (9 * degrees)
    return (math.pow(ratio, 1 / 3) - (1 - share)) / math.sqrt(share)


def chance(z: float) -> float:
    """Chance of so large a deviation to either side."""
    return math.erfc(abs(z) / math.sqrt(2))


def tested(found: Gathered, fixed: float, at_edge: float = 0.0) -> dict[str, Any]:
    """Measured over predicted, with sampling errors; what lost pixels to saturation has no prediction. The squared error of the
    mean is less by up to the share `at_edge`."""
    row: dict[str, Any] = {
        "mean": found.mean.mean if found.mean.count else None,
        "mean_spread": found.mean.spread,
        "std": math.sqrt(found.variance.mean) if found.variance.count else None,
        "snr_db": found.snr_db.mean if found.snr_db.count else None,
        "clipped": found.clipped,
        "left_out": found.left_out,
    }
    if found.predicted is None or found.errors is None:
        return row
    mean, std = found.predicted
    row |= {"predicted_mean": mean, "predicted_std": std, "predicted_fixed_share": fixed}
    if std <= 0:
        return row
    frames = found.variance.count
    one_mean, one_std = found.errors[0] * std, 2 * found.errors[1]
    # About its own mean a frame scatters less than about the expectation, where neighbors are alike by more than 1/n.
    expected = (std**2 - one_mean**2) * found.pixels / (found.pixels - 1)
    ratio = found.variance.mean / expected
    ratio_error = one_std * math.sqrt(fixed**2 + (1 - fixed**2) / frames)
    mean_error = one_mean * math.sqrt(fixed + (1 - fixed) / frames)
    spread = found.variance.spread
    row |= {
        "mean_error": mean_error,
        "variance_ratio": ratio,
        "variance_ratio_error": ratio_error,
        "variance_ratio_spread": None if spread is None else spread / expected,
        "variance_ratio_predicted_spread": one_std * math.sqrt(1 - fixed**2),
    }
    if found.left_out or found.clipped:
        return row
    largest = (std**2 - (1 - at_edge) * one_mean**2) / (std**2 - one_mean**2)
    beyond = ratio / min(max(ratio, 1.0), largest)
    z_mean, z_variance = (found.mean.mean - mean) / mean_error, cube_root_z(beyond, 2 / ratio_error**2)
    # The smaller of two chances, times two for there were two.
    return row | {"z_mean": z_mean, "z_variance": z_variance, "p": min(1.0, 2 * chance(max(z_mean, z_variance, key=abs)))}


class OfCondition:
    """Gathers the rows of a condition, block by block."""

    def __init__(self, plan: Plan, condition: Condition, said: dict[str, Any]) -> None:
        width, height = plan.measured_size
        self._settings = table.settings(plan, condition, said)
        self._formulas = {part["stage"]: part for part in said["stages"]}
        self._pixels = width * height
        self._at_edge = min(1.0, REACH * (1 / width + 1 / height))
        self._gathered = {(stage, channel): Gathered() for stage in plan.sweep.stages for channel in reports.CHANNELS[stage]}

    def add(self, block: pa.Table) -> None:
        """Takes a block of frames."""
        for (stage, channel), found in self._gathered.items():
            quarters = (2 if channel == "G" else 1) if stage == "adu" else 4
            found.add(stage, channel, block, self._pixels * quarters // 4)

    def rows(self) -> list[dict[str, Any]]:
        """The rows, without the verdicts."""
        rows = []
        for (stage, channel), found in self._gathered.items():
            formula = self._formulas[stage]
            at = reports.CHANNELS[stage].index(channel)
            std = formula["std"][at]
            fixed = min(1.0, (formula["fixed_pattern_std"][at] / std) ** 2) if std > 0 else 0.0
            names = {"frames": found.frames, "stage": stage, "channel": channel, "unit": formula["unit"]}
            measured = {"predicted_snr_db": formula["snr_db"][at], **tested(found, fixed, 0.0 if stage == "adu" else self._at_edge)}
            rows.append({**self._settings, **names, **{key: _rounded(value) for key, value in measured.items()}})
        return rows


def judged(rows: list[dict[str, Any]]) -> pa.Table:
    """The summary: each test at its share of LEVEL."""
    count = sum(row.get("p") is not None for row in rows)
    for row in rows:
        row["holds"] = None if row.get("p") is None else row["p"] >= LEVEL / count
    return pa.Table.from_pylist(rows, schema=schema())


def _rounded(value: Any) -> Any:
    """Twelve digits: the last ones of roots and logarithms hang on the machine's mathematical library."""
    return float(f"{value:.12g}") if isinstance(value, float) else value
