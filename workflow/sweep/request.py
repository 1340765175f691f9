"""A sweep as it was asked for."""

import dataclasses
import pathlib
from typing import Any


@dataclasses.dataclass(frozen=True)
class Sensor:
    """A sensor by name or file, or a camera's response with the read-out of another sensor."""

    name: str
    sensor: str
    readout: str | None = None
    counts: str | None = None
    peak_quantum_efficiency: float | None = None


@dataclasses.dataclass(frozen=True)
class Sky:
    """What the camera looks at: a spectrum, one of a library, or electrons given outright."""

    name: str
    file: str | None = None
    sample: int | None = None
    column: str | None = None
    radiance_unit: str | None = None
    electrons: tuple[float, ...] | None = None


@dataclasses.dataclass(frozen=True)
class Keep:
    """Frames that stay as files: of which stage, which numbers, and which conditions."""

    stage: str
    frames: tuple[int, ...]
    where: dict[str, tuple[Any, ...]]


@dataclasses.dataclass(frozen=True)
class Sweep:
    """A sweep as it was asked for."""

    output: pathlib.PurePosixPath
    plots: str | None
    seed: int
    sensor_seed: int
    frames: range
    frames_per_job: int
    width: int
    height: int
    f_number: float
    lens_transmittance: float
    matrix: str
    white_luminance_cd_per_m2: float | None
    stages: tuple[str, ...]
    sensors: tuple[Sensor, ...]
    exposures_s: tuple[float, ...]
    exposures_to: tuple[float, ...]
    temperatures_k: tuple[float | None, ...]
    skies: tuple[Sky, ...]
    methods: tuple[str, ...]
    keep: Keep | None
