"""The YAML of a sweep as a value, checked before anything runs."""

import dataclasses
import math
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

from . import lines, programs
from .mistakes import Mistakes, choice

SCHEMA = "cyanometer-sweep/1"
STAGES = ("adu", "demosaicked", "xyz", "lab")
KEPT_STAGES = ("adu", "demosaicked", "xyz")
FRAMES_PER_JOB = (500, 5000)
LARGEST_SEED = 2**63 - 1
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*")
KEYS = {
    "schema", "output", "plots", "seed", "sensor_seed", "frames", "frames_per_job", "size", "f_number",
    "lens_transmittance", "matrix", "white_luminance_cd_per_m2", "stages", "sweep", "keep",
}  # fmt: skip


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


class _Refused(Exception):
    """A value cannot be used; what was wrong is noted."""


class _Reader:
    """Reads values and notes what is wrong with them."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.value, self.lines = lines.load(name, text)
        self.told: list[str] = []

    def note(self, path: lines.Path, what: str) -> None:
        """Notes a mistake at a place, or at the nearest around it."""
        near = path
        while near not in self.lines and near:
            near = near[:-1]
        where = ".".join(str(key + 1 if isinstance(key, int) else key) for key in path)
        self.told.append(f"{self.name}:{self.lines.get(near, 1)}: {where + ': ' if where else ''}{what}")

    def refuse(self, path: lines.Path, what: str) -> _Refused:
        self.note(path, what)
        return _Refused()

    def keys(self, path: lines.Path, value: Any, known: set[str]) -> dict[str, Any]:
        """A mapping with no other keys than these."""
        if not isinstance(value, dict):
            raise self.refuse(path, f"this is {_kind(value)}; keys with values are wanted")
        for key in value:
            if key not in known:
                self.note((*path, key), f"there is no such key; {choice(key, sorted(known))}")
        return value

    def number(self, path: lines.Path, value: Any, low: float, high: float, *, above: bool = False) -> float:
        """A finite number in a range, above its lower end or at least as large."""
        if isinstance(value, str):
            # YAML reads 1e-3, without a point, as text.
            try:
                value = float(value)
            except ValueError:
                pass
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.refuse(path, f"{_shown(value)} is {_kind(value)}; a number is wanted")
        if not (math.isfinite(value) and (low < value if above else low <= value) and value <= high):
            least = f"above {low:g}" if above else f"at least {low:g}"
            raise self.refuse(
                path, f"{value} is out of range; it is {least}{f' and at most {high:g}' if high < math.inf else ''}"
            )
        return float(value)

    def whole(self, path: lines.Path, value: Any, low: int, high: int) -> int:
        """A whole number in a range."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.refuse(path, f"{_shown(value)} is {_kind(value)}; a whole number is wanted")
        if not low <= value <= high:
            raise self.refuse(path, f"{value} is out of range; it lies within {low} and {high}")
        return value

    def word(self, path: lines.Path, value: Any, known: Sequence[str]) -> str:
        """One of some words."""
        if not isinstance(value, str) or value not in known:
            raise self.refuse(path, f"{_shown(value)} is unknown; {choice(str(value), known)}")
        return value

    def text(self, path: lines.Path, value: Any) -> str:
        if not isinstance(value, str) or not value:
            raise self.refuse(path, f"{_shown(value)} is {_kind(value)}; text is wanted")
        return value

    def file(self, path: lines.Path, value: Any) -> str:
        """The name of a file that can be read."""
        name = self.text(path, value)
        if not pathlib.Path(name).is_file():
            raise self.refuse(path, f"there is no file {name}")
        return name

    def several(self, path: lines.Path, value: Any, one: Callable[[lines.Path, Any], Any]) -> tuple[Any, ...]:
        """A list with something in it and nothing twice; a single value is a list of one."""
        items = value if isinstance(value, list) else [value]
        if not items:
            raise self.refuse(path, "this is empty: nothing would be swept")
        found: list[Any] = []
        for number, item in enumerate(items):
            here = (*path, number) if isinstance(value, list) else path
            read = self.attempt(lambda here=here, item=item: one(here, item))  # type: ignore[misc]
            if read is not _NOTHING:
                if read in found:
                    self.note(here, f"{_shown(item)} stands twice")
                found.append(read)
        return tuple(found)

    def attempt(self, read: Callable[[], Any], otherwise: Any = None) -> Any:
        """What is read, or _NOTHING where that is refused, so that other mistakes are found too."""
        try:
            return read()
        except _Refused:
            return _NOTHING if otherwise is None else otherwise

    def frames(self, path: lines.Path, value: Any) -> range:
        """A number of frames, or A..B, from A to the one before B."""
        match = re.fullmatch(r"(\d+)\.\.(\d+)", value) if isinstance(value, str) else None
        if match:
            found = range(int(match[1]), int(match[2]))
        elif isinstance(value, int) and not isinstance(value, bool):
            found = range(value)
        else:
            raise self.refuse(
                path, f"{_shown(value)} is no range of frames; give a number, or A..B, from A to the one before B"
            )
        if not found or found.stop > 2**32:
            raise self.refuse(path, f"{_shown(value)} is out of range: there is at least one frame, and none beyond 2^32")
        return found

    def sensor(self, path: lines.Path, value: Any) -> Sensor:
        """A sensor by name or file, or a mapping with its read-out."""
        if isinstance(value, str):
            value = {"sensor": value}
        given = self.keys(path, value, {"name", "sensor", "readout", "counts", "peak_quantum_efficiency"})
        if "sensor" not in given:
            raise self.refuse(path, "the key `sensor` is missing, the name of a sensor or a sensor file")
        sensor = self._known_sensor((*path, "sensor"), given["sensor"])
        readout = self._known_sensor((*path, "readout"), given["readout"]) if "readout" in given else None
        counts = self.word((*path, "counts"), given["counts"], ("energy", "quanta")) if "counts" in given else None
        peak = None
        if "peak_quantum_efficiency" in given:
            peak = self.number((*path, "peak_quantum_efficiency"), given["peak_quantum_efficiency"], 0, 1, above=True)
        name = self._name(path, given, "+".join(pathlib.PurePath(part).stem for part in (sensor, readout) if part))
        return Sensor(name, sensor, readout, counts, peak)

    def _known_sensor(self, path: lines.Path, value: Any) -> str:
        name = self.text(path, value)
        known = programs.sensors()
        if name not in known and not pathlib.Path(name).is_file():
            raise self.refuse(
                path, f"`{name}` is neither a known sensor nor a file; {choice(name, known)} (cyanometer list sensors)"
            )
        return name

    def sky(self, path: lines.Path, value: Any) -> Sky:
        """A spectrum by its file, or a mapping."""
        if isinstance(value, str):
            value = {"file": value}
        given = self.keys(path, value, {"name", "file", "sample", "column", "radiance_unit", "electrons"})
        if ("file" in given) == ("electrons" in given):
            raise self.refuse(path, "a sky is either a `file` or `electrons`, [R, G, B]")
        if "electrons" in given:
            for key in {"sample", "column", "radiance_unit"} & set(given):
                self.note((*path, key), "electrons have no spectrum")
            values = given["electrons"]
            if not isinstance(values, list) or len(values) != 3:
                raise self.refuse((*path, "electrons"), "three numbers are wanted, [R, G, B]")
            electrons = tuple(self.number((*path, "electrons", n), e, 0, math.inf) for n, e in enumerate(values))
            return Sky(self._name(path, given, "electrons" + "-".join(f"{e:g}" for e in electrons)), electrons=electrons)
        file = self.file((*path, "file"), given["file"])
        sample = self.whole((*path, "sample"), given["sample"], 0, 2**31) if "sample" in given else None
        column = self.text((*path, "column"), given["column"]) if "column" in given else None
        unit = self.text((*path, "radiance_unit"), given["radiance_unit"]) if "radiance_unit" in given else None
        stem = pathlib.PurePath(file).stem
        name = self._name(
            path, given, "-".join([stem, *([str(sample)] if sample is not None else []), *([column] if column else [])])
        )
        return Sky(name, file, sample, column, unit)

    def _name(self, path: lines.Path, given: dict[str, Any], otherwise: str) -> str:
        """A name that stands in the table and in the names of files."""
        if "name" not in given:
            return re.sub(r"[^A-Za-z0-9._+-]+", "-", otherwise).lstrip(".+-")
        name = self.text((*path, "name"), given["name"])
        if not NAME.fullmatch(name):
            raise self.refuse((*path, "name"), f"`{name}` is no name: letters, digits, `.`, `_`, `+` and `-` make one")
        return name


class _Nothing:
    """Stands for what could not be read."""


_NOTHING = _Nothing()


def _kind(value: Any) -> str:
    for kind, word in (
        (bool, "yes or no"),
        (int, "a whole number"),
        (float, "a number"),
        (str, "text"),
        (list, "a list"),
        (dict, "a mapping"),
    ):
        if isinstance(value, kind):
            return word
    return "nothing" if value is None else type(value).__name__


def _shown(value: Any) -> str:
    return f"`{value}`" if isinstance(value, str) else str(value)


def read(name: str, text: str) -> Sweep:
    """Reads a sweep, or raises all mistakes that are in it."""
    reader = _Reader(name, text)
    try:
        top = reader.keys((), reader.value, KEYS)
    except _Refused:
        raise Mistakes(reader.told) from None
    for key in ("schema", "output", "seed", "frames", "size", "sweep"):
        if key not in top:
            reader.note((), f"the key `{key}` is missing")

    def get(key: str, default: Any, one: Callable[[lines.Path, Any], Any]) -> Any:
        return reader.attempt(lambda: one((key,), top[key]), default) if key in top else default

    get("schema", SCHEMA, lambda path, value: reader.word(path, value, (SCHEMA,)))
    output = get("output", "sweep.parquet", lambda path, value: _output(reader, path, value))
    plots = get("plots", "svg", lambda path, value: reader.word(path, value, ("svg", "png", "none")))
    frames = get("frames", range(1), reader.frames)
    size = get("size", (64, 48), lambda path, value: _size(reader, path, value))
    stages = get("stages", STAGES[:3], lambda p, v: reader.several(p, v, lambda p, v: reader.word(p, v, STAGES)))
    white = None
    if "white_luminance_cd_per_m2" in top:
        white = get("white_luminance_cd_per_m2", 1.0, lambda p, v: reader.number(p, v, 0, math.inf, above=True))
    if "lab" in stages and white is None:
        reader.note(("stages",), "lab needs white_luminance_cd_per_m2, or colors of two exposures would have two whites")
    if "lab" not in stages and white is not None:
        reader.note(("white_luminance_cd_per_m2",), "this has no effect where lab is no stage")
    axes = _axes(reader, top.get("sweep"))
    sweep = Sweep(
        output=pathlib.PurePosixPath(output),
        plots=None if plots == "none" else plots,
        seed=get("seed", 0, lambda path, value: reader.whole(path, value, 0, LARGEST_SEED)),
        sensor_seed=get("sensor_seed", 0, lambda path, value: reader.whole(path, value, 0, LARGEST_SEED)),
        frames=frames,
        frames_per_job=get("frames_per_job", 1000, lambda path, value: reader.whole(path, value, *FRAMES_PER_JOB)),
        width=size[0],
        height=size[1],
        f_number=get("f_number", 8.0, lambda path, value: reader.number(path, value, 0, 1000, above=True)),
        lens_transmittance=get("lens_transmittance", 1.0, lambda path, value: reader.number(path, value, 0, 1, above=True)),
        matrix=get("matrix", "sensor", lambda p, v: v if v == "sensor" else reader.file(p, v)),
        white_luminance_cd_per_m2=white,
        stages=tuple(stage for stage in STAGES if stage in stages),
        **axes,
        keep=get("keep", None, lambda path, value: _keep(reader, path, value, frames, axes)),
    )
    _together(reader, sweep)
    if reader.told:
        raise Mistakes(reader.told)
    return sweep


def _output(reader: _Reader, path: lines.Path, value: Any) -> str:
    name = reader.text(path, value)
    if pathlib.PurePath(name).suffix not in {".parquet", ".csv"}:
        raise reader.refuse(path, f"`{name}` ends in neither .parquet nor .csv")
    return name


def _size(reader: _Reader, path: lines.Path, value: Any) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", value) if isinstance(value, str) else None
    if not match or any(int(side) < 12 or int(side) % 2 for side in match.groups()):
        raise reader.refuse(
            path, f"{_shown(value)} is no size: give WIDTHxHEIGHT in photosites, each even and at least 12, such as 64x48"
        )
    return int(match[1]), int(match[2])


def _axes(reader: _Reader, value: Any) -> dict[str, Any]:
    """What is swept; each axis is a list with something in it."""
    axes: dict[str, Any] = {
        "sensors": (), "exposures_s": (), "exposures_to": (), "temperatures_k": (None,), "skies": (), "methods": ("eci",),
    }  # fmt: skip
    if value is None:
        return axes
    given = reader.attempt(
        lambda: reader.keys(("sweep",), value, {"sensor", "exposure_s", "expose_to", "temperature_k", "sky", "method"}), {}
    )

    def temperature(path: lines.Path, value: Any) -> float | None:
        return None if value == "sensor" else reader.number(path, value, 0, 1000, above=True)

    readers: dict[str, tuple[str, Callable[[lines.Path, Any], Any]]] = {
        "sensor": ("sensors", reader.sensor),
        "exposure_s": ("exposures_s", lambda p, v: reader.number(p, v, 0, math.inf, above=True)),
        "expose_to": ("exposures_to", lambda p, v: reader.number(p, v, 0, 1, above=True)),
        "temperature_k": ("temperatures_k", temperature),
        "sky": ("skies", reader.sky),
        "method": ("methods", lambda p, v: reader.word(p, v, programs.METHODS)),
    }
    for key, (axis, one) in readers.items():
        if key in given:
            axes[axis] = reader.attempt(lambda key=key, one=one: reader.several(("sweep", key), given[key], one), ())  # type: ignore[misc]
    for key in ("sensor", "sky"):
        if key not in given:
            reader.note(("sweep",), f"the key `{key}` is missing")
    if ("exposure_s" in given) == ("expose_to" in given):
        reader.note(
            ("sweep",), "either `exposure_s` or `expose_to` is wanted, the share of full well of the brightest class"
        )
    for key, axis in (("sensor", "sensors"), ("sky", "skies")):
        names = [one.name for one in axes[axis]]
        for number, name in enumerate(names):
            if name in names[:number]:
                reader.note(("sweep", key, number), f"two are called {name}; give one of them another `name`")
    return axes


def _keep(reader: _Reader, path: lines.Path, value: Any, frames: range, axes: dict[str, Any]) -> Keep:
    """Which frames stay as files; a condition that no value of the sweep meets is a mistake."""
    given = reader.keys(path, value, {"stage", "frames", "where"})
    for key in ("stage", "frames"):
        if key not in given:
            raise reader.refuse(path, f"the key `{key}` is missing")
    stage = reader.word((*path, "stage"), given["stage"], KEPT_STAGES)
    numbers = given["frames"]
    if isinstance(numbers, list):
        kept = reader.several((*path, "frames"), numbers, lambda p, v: reader.whole(p, v, 0, 2**32))
    else:
        kept = tuple(reader.frames((*path, "frames"), numbers))
    if not all(number in frames for number in kept):
        raise reader.refuse((*path, "frames"), f"some are not among the frames {frames.start}..{frames.stop} of the sweep")
    names: dict[str, Sequence[Any]] = {
        "sensor": [sensor.name for sensor in axes["sensors"]],
        "exposure_s": axes["exposures_s"],
        "expose_to": axes["exposures_to"],
        "temperature_k": ["sensor" if kelvin is None else kelvin for kelvin in axes["temperatures_k"]],
        "sky": [sky.name for sky in axes["skies"]],
        "method": axes["methods"],
    }
    where = {}
    for key, wanted in reader.keys((*path, "where"), given.get("where", {}), set(names)).items():
        if key in names:
            wanted = wanted if isinstance(wanted, list) else [wanted]
            for item in wanted:
                if item not in names[key]:
                    words = ", ".join(str(name) for name in names[key]) or "nothing"
                    reader.note((*path, "where", key), f"{_shown(item)} is not swept; the sweep has {words}")
            where[key] = tuple(wanted)
    return Keep(stage, tuple(sorted(kept)), where)


def _together(reader: _Reader, sweep: Sweep) -> None:
    """What each value allows, but not all of them together."""
    known = programs.sensors()
    colors = bool({"xyz", "lab"} & set(sweep.stages)) or (sweep.keep is not None and sweep.keep.stage == "xyz")
    spectra = [sky.name for sky in sweep.skies if sky.file]
    for number, sensor in enumerate(sweep.sensors):
        here = ("sweep", "sensor", number)
        about = known.get(sensor.sensor)
        readout = known.get(sensor.readout) if sensor.readout else about
        if readout and not readout.has_readout:
            reader.note(here, f"{sensor.readout or sensor.sensor} has no read-out; give one: {{sensor: …, readout: imx477}}")
        if about is None:
            continue
        if about.response == "none" and spectra:
            reader.note(
                here,
                f"{sensor.sensor} has no response, so that it sees no spectrum; give `electrons` for the sky, or the response of a camera with `readout: {sensor.sensor}`",
            )
        if about.response == "none" and colors:
            reader.note(
                here,
                f"{sensor.sensor} has no response and so no matrix; leave xyz and lab out of `stages`, or give the response of a camera",
            )
        if about.response == "relative" and spectra and sensor.peak_quantum_efficiency is None:
            reader.note(here, f"the response of {sensor.sensor} is relative; give `peak_quantum_efficiency` with it")
        if about.response != "relative" and sensor.peak_quantum_efficiency is not None:
            reader.note(here, f"the response of {sensor.sensor} is {about.response}; leave out `peak_quantum_efficiency`")
        if about.response == "relative" and colors and sweep.matrix == "sensor":
            reader.note(
                here,
                f"{sensor.sensor} has no matrix of its own; name a library of spectra as `matrix`, from which one is fitted",
            )
    if sweep.exposures_to:
        for number, sky in enumerate(sweep.skies):
            if sky.electrons:
                reader.note(
                    ("sweep", "sky", number), "electrons given outright do not follow `expose_to`; give `exposure_s`"
                )
    if sweep.matrix.endswith((".yaml", ".yml")):
        if len(sweep.sensors) > 1:
            reader.note(
                ("matrix",),
                "one matrix does not fit several sensors; name a library of spectra, from which each gets its own",
            )
        if colors and "unit: cd m-2" not in pathlib.Path(sweep.matrix).read_text():
            reader.note(("matrix",), f"{sweep.matrix} gives no absolute XYZ, whose unit is cd m-2")
