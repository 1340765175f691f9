"""Which files are made, and by which ranges of frames."""

import dataclasses
import functools
import itertools
import pathlib

from . import conditions, files, programs, reading, request
from .conditions import Condition
from .mistakes import Mistakes

FORMAT = "2"  # of the files in the work directory; another number, and all are made again
RIM = 4  # photosites at each side that no statistic counts: demosaicking has fewer neighbors there than predictions suppose


@dataclasses.dataclass(frozen=True)
class Plan:
    """A sweep with its conditions and the names of its files."""

    sweep: request.Sweep
    conditions: list[Condition]

    @property
    def _stem(self) -> str:
        return str(self.sweep.output.with_suffix(""))

    @property
    def measured_size(self) -> tuple[int, int]:
        """Width and height of what is measured of a frame."""
        return self.sweep.width - 2 * RIM, self.sweep.height - 2 * RIM

    @property
    def table(self) -> str:
        return str(self.sweep.output)

    @property
    def summary(self) -> str:
        return f"{self._stem}-summary{self.sweep.output.suffix}"

    @property
    def plots(self) -> dict[str, str]:
        """Files of the figures, by what they show."""
        if self.sweep.plots is None:
            return {}
        shown = ["spread", "snr"] + (["color-error"] if "lab" in self.sweep.stages else [])
        return {name: f"{self._stem}-{name}.{self.sweep.plots}" for name in shown}

    @property
    def checksums(self) -> str:
        return f"{self._stem}.b3"

    @property
    def kept(self) -> str:
        """Directory of the frames that stay."""
        return f"{self._stem}-frames"

    @property
    def work(self) -> str:
        """Directory of what is needed on the way."""
        return f"{self._stem}-work"

    @functools.cached_property
    def directories(self) -> dict[str, Condition]:
        """The conditions by the names of their directories."""
        return {self.directory(condition): condition for condition in self.conditions}

    @functools.cached_property
    def scenes(self) -> dict[str, Condition]:
        """A condition for each scene: its frames hang on neither temperature nor method."""
        return {self.scene_key(condition): condition for condition in self.conditions}

    @functools.cached_property
    def sensors(self) -> dict[str, request.Sensor]:
        """Sensors by the keys of their matrices."""
        return {self.matrix_key(sensor): sensor for sensor in self.sweep.sensors}

    def directory(self, condition: Condition) -> str:
        return f"{condition.name}-{self._key(condition.number)}"

    @functools.cache  # noqa: B019, a plan lives as long as its program
    def _key(self, number: int) -> str:
        return files.keyed(FORMAT, conditions.key(self.sweep, self.conditions[number]))[:12]

    def scene_key(self, condition: Condition) -> str:
        sweep = self.sweep
        fields = (programs.version(), conditions.scene_options(sweep, condition), sweep.width, sweep.height)
        return files.keyed("scene", *fields)[:12]

    def matrix_key(self, sensor: request.Sensor) -> str:
        fields = (programs.version(), conditions.sensor_options(sensor), conditions.optics_options(self.sweep))
        return files.keyed("matrix", self.sweep.matrix, *fields)[:12]

    def scene(self, condition: Condition) -> str:
        return f"{self.work}/scenes/{self.scene_key(condition)}.exr"

    def predicted(self, condition: Condition) -> str:
        return f"{self.work}/{self.directory(condition)}/predicted.json"

    def matrix(self, sensor: request.Sensor) -> str | None:
        """The matrix file of a sensor, where it is not in the sensor's own."""
        if self.sweep.matrix == "sensor":
            return None
        if self.sweep.matrix.endswith((".yaml", ".yml")):
            return self.sweep.matrix
        return f"{self.work}/matrices/{self.matrix_key(sensor)}.yaml"

    def matrices(self, condition: Condition, *, stages: tuple[str, ...]) -> list[str]:
        """The matrix file as an input of a job that needs it, or nothing."""
        matrix = self.matrix(condition.sensor) if {"xyz", "lab"} & set(stages) else None
        return [matrix] if matrix else []

    def ranges(self) -> list[range]:
        """The frames of the jobs; the last may have fewer."""
        frames, step = self.sweep.frames, self.sweep.frames_per_job
        return [frames[start : start + step] for start in range(0, len(frames), step)]

    def parts(self, condition: Condition) -> list[str]:
        """The measured ranges of a condition, in the order of their frames."""
        directory = f"{self.work}/{self.directory(condition)}"
        return [f"{directory}/{part.start:010}-{part.stop:010}.parquet" for part in self.ranges()]

    def kept_ranges(self) -> list[range]:
        """Runs of consecutive numbers among the frames that stay, none longer than a job."""
        keep = self.sweep.keep
        if keep is None:
            return []
        runs = []
        for _, run in itertools.groupby(enumerate(keep.frames), lambda pair: pair[1] - pair[0]):
            numbers = [number for _, number in run]
            run_range = range(numbers[0], numbers[-1] + 1)
            step = self.sweep.frames_per_job
            runs += [run_range[start : start + step] for start in range(0, len(run_range), step)]
        return runs

    def keeps(self, condition: Condition) -> bool:
        """Whether frames of a condition stay."""
        keep = self.sweep.keep
        return keep is not None and all(condition.value(axis) in wanted for axis, wanted in keep.where.items())

    def kept_parts(self) -> list[str]:
        """Lists of the frames that stay, of all jobs that keep some."""
        stage = self.sweep.keep.stage if self.sweep.keep else ""
        return [
            f"{self.work}/{self.directory(condition)}/{stage}-{part.start:010}-{part.stop:010}.b3"
            for condition in self.conditions
            if self.keeps(condition)
            for part in self.kept_ranges()
        ]

    def all_parts(self) -> list[str]:
        """The measured ranges of all conditions."""
        return [part for condition in self.conditions for part in self.parts(condition)]

    @functools.cached_property
    def digest(self) -> str:
        """Another one, and table and figures are made again."""
        wanted = [self.directory(condition) for condition in self.conditions]
        return files.keyed("table", self.sweep.output, self.sweep.frames, *wanted)

    def __hash__(self) -> int:
        return id(self)


def read(path: str) -> Plan:
    """The plan of a sweep; mistakes in it are raised all at once."""
    try:
        text = pathlib.Path(path).read_text()
    except OSError as error:
        raise Mistakes([f"{path}: cannot read: {error.strerror}"]) from error
    programs.check()
    sweep = reading.read(path, text)
    return Plan(sweep, conditions.of(sweep))
