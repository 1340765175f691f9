"""What is swept, and which frames stay."""

import math
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

from . import lines, programs
from .mistakes import choice
from .request import Keep, Sensor, Sky
from .values import Reader, shown

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*")
KEPT_STAGES = ("adu", "demosaicked", "xyz")


def sensor(reader: Reader, path: lines.Path, value: Any) -> Sensor:
    """A sensor by name or file, or a mapping with its read-out."""
    if isinstance(value, str):
        value = {"sensor": value}
    given = reader.keys(path, value, {"name", "sensor", "readout", "counts", "peak_quantum_efficiency"})
    if "sensor" not in given:
        raise reader.refuse(path, "the key `sensor` is missing, the name of a sensor or a sensor file")
    sensor = _known_sensor(reader, (*path, "sensor"), given["sensor"])
    readout = _known_sensor(reader, (*path, "readout"), given["readout"]) if "readout" in given else None
    counts = reader.word((*path, "counts"), given["counts"], ("energy", "quanta")) if "counts" in given else None
    peak = None
    if "peak_quantum_efficiency" in given:
        peak = reader.number((*path, "peak_quantum_efficiency"), given["peak_quantum_efficiency"], 0, 1, above=True)
    name = _name(reader, path, given, "+".join(pathlib.PurePath(part).stem for part in (sensor, readout) if part))
    return Sensor(name, sensor, readout, counts, peak)


def _known_sensor(reader: Reader, path: lines.Path, value: Any) -> str:
    name = reader.text(path, value)
    known = programs.sensors()
    if name not in known and not pathlib.Path(name).is_file():
        raise reader.refuse(
            path, f"`{name}` is neither a known sensor nor a file; {choice(name, known)} (cyanometer list sensors)"
        )
    return name


def sky(reader: Reader, path: lines.Path, value: Any) -> Sky:
    """A spectrum by its file, or a mapping."""
    if isinstance(value, str):
        value = {"file": value}
    given = reader.keys(path, value, {"name", "file", "sample", "column", "radiance_unit", "electrons"})
    if ("file" in given) == ("electrons" in given):
        raise reader.refuse(path, "a sky is either a `file` or `electrons`, [R, G, B]")
    if "electrons" in given:
        for key in {"sample", "column", "radiance_unit"} & set(given):
            reader.note((*path, key), "electrons have no spectrum")
        values = given["electrons"]
        if not isinstance(values, list) or len(values) != 3:
            raise reader.refuse((*path, "electrons"), "three numbers are wanted, [R, G, B]")
        electrons = tuple(reader.number((*path, "electrons", n), e, 0, math.inf) for n, e in enumerate(values))
        return Sky(_name(reader, path, given, "electrons" + "-".join(f"{e:g}" for e in electrons)), electrons=electrons)
    file = reader.file((*path, "file"), given["file"])
    sample = reader.whole((*path, "sample"), given["sample"], 0, 2**31) if "sample" in given else None
    column = reader.text((*path, "column"), given["column"]) if "column" in given else None
    unit = reader.text((*path, "radiance_unit"), given["radiance_unit"]) if "radiance_unit" in given else None
    stem = pathlib.PurePath(file).stem
    name = _name(
        reader, path, given, "-".join([stem, *([str(sample)] if sample is not None else []), *([column] if column else [])])
    )
    return Sky(name, file, sample, column, unit)


def _name(reader: Reader, path: lines.Path, given: dict[str, Any], otherwise: str) -> str:
    """A name that stands in the table and in the names of files."""
    if "name" not in given:
        return re.sub(r"_{2,}", "_", re.sub(r"[^A-Za-z0-9._+-]+", "-", otherwise)).strip("._+-")
    name = reader.text((*path, "name"), given["name"])
    if not NAME.fullmatch(name) or "__" in name or name.endswith("_"):
        raise reader.refuse(
            (*path, "name"), f"`{name}` is no name: letters, digits, `.`, `+`, `-` and single `_` within make one"
        )
    return name


def axes(reader: Reader, value: Any) -> dict[str, Any]:
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
        "sensor": ("sensors", lambda p, v: sensor(reader, p, v)),
        "exposure_s": ("exposures_s", lambda p, v: reader.number(p, v, 0, math.inf, above=True)),
        "expose_to": ("exposures_to", lambda p, v: reader.number(p, v, 0, 1, above=True)),
        "temperature_k": ("temperatures_k", temperature),
        "sky": ("skies", lambda p, v: sky(reader, p, v)),
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
                reader.note(("sweep", key), f"two are called {name}; give one of them another `name`")
    return axes


def keep(reader: Reader, path: lines.Path, value: Any, frames: range, axes: dict[str, Any]) -> Keep:
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
                    reader.note((*path, "where", key), f"{shown(item)} is not swept; the sweep has {words}")
            where[key] = tuple(wanted)
    return Keep(stage, tuple(sorted(kept)), where)
