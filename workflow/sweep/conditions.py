"""What is simulated: each condition with its seed and the options of the programs."""

import dataclasses
import itertools

from . import files, programs
from .request import Sensor, Sky, Sweep


@dataclasses.dataclass(frozen=True)
class Condition:
    """One sensor at one exposure, temperature and sky, by one demosaicking method; `number` is its place in the sweep."""

    number: int
    sensor: Sensor
    exposure_s: float | None
    expose_to: float | None
    temperature_k: float | None
    sky: Sky
    method: str
    seed: int

    @property
    def name(self) -> str:
        """What tells it from the others of its sweep, as part of the name of a file: no name in it has two underlines."""
        return "__".join([self.sensor.name, self._exposure, self._temperature, self.sky.name, self.method])

    @property
    def _exposure(self) -> str:
        return f"{self.exposure_s!r}s" if self.exposure_s is not None else f"{self.expose_to!r}full"

    @property
    def _temperature(self) -> str:
        return "asis" if self.temperature_k is None else f"{self.temperature_k!r}K"

    def value(self, axis: str) -> object:
        """Its value on an axis of the sweep, as the YAML gives it."""
        if axis in {"sensor", "sky"}:
            return getattr(self, axis).name
        if axis == "temperature_k" and self.temperature_k is None:
            return "sensor"
        return getattr(self, axis)


def of(sweep: Sweep) -> list[Condition]:
    """All conditions, in the order of the YAML: the last axis turns fastest."""
    exposures = [(s, None) for s in sweep.exposures_s] + [(None, share) for share in sweep.exposures_to]
    axes = itertools.product(sweep.sensors, exposures, sweep.temperatures_k, sweep.skies, sweep.methods)
    return [
        Condition(number, sensor, exposure[0], exposure[1], kelvin, sky, method, _seed(sweep, sensor, exposure, kelvin, sky))
        for number, (sensor, exposure, kelvin, sky, method) in enumerate(axes)
    ]


def _seed(sweep: Sweep, sensor: Sensor, exposure: object, kelvin: float | None, sky: Sky) -> int:
    """Seed of a condition's temporal noise: by what it is, not where it stands; methods see the same frames."""
    key = files.keyed("seed", sweep.seed, sensor.name, exposure, kelvin, sky.name)
    return int(key[:16], 16) >> 1


def sensor_options(sensor: Sensor) -> list[str]:
    """Options that name the sensor."""
    options = ["--sensor", sensor.sensor]
    for option, value in (
        ("--readout", sensor.readout),
        ("--counts", sensor.counts),
        ("--peak-quantum-efficiency", sensor.peak_quantum_efficiency),
    ):
        options += [] if value is None else [option, str(value)]
    return options


def optics_options(sweep: Sweep) -> list[str]:
    """Options that name the lens."""
    return ["--f-number", repr(sweep.f_number), "--lens-transmittance", repr(sweep.lens_transmittance)]


def scene_options(sweep: Sweep, condition: Condition) -> list[str]:
    """Options of what the camera looks at, for render-radiance and predict-noise."""
    sky = condition.sky
    options = [sky.file] if sky.file else []
    for option, value in (("--sample", sky.sample), ("--column", sky.column), ("--radiance-unit", sky.radiance_unit)):
        options += [] if value is None else [option, str(value)]
    if sky.electrons:
        options += ["--electrons", ",".join(repr(e) for e in sky.electrons)]
    if condition.exposure_s is not None:
        options += ["--exposure", repr(condition.exposure_s)]
    else:
        options += ["--expose-to", repr(condition.expose_to)]
    return options + sensor_options(condition.sensor) + optics_options(sweep)


def temperature_options(condition: Condition) -> list[str]:
    """Options of the temperature; without them the sensor has its own."""
    return [] if condition.temperature_k is None else ["--temperature", repr(condition.temperature_k)]


def key(sweep: Sweep, condition: Condition) -> str:
    """Tells results of a condition from those of other settings: what they hang on, but neither frames nor place."""
    fields = (
        programs.version(), scene_options(sweep, condition), condition.sensor.name, condition.sky.name,
        condition.temperature_k, condition.method, condition.seed, sweep.sensor_seed, sweep.width, sweep.height,
        sweep.matrix, sweep.white_luminance_cd_per_m2, sweep.stages,
    )  # fmt: skip
    return files.keyed("condition", *fields)[:12]
