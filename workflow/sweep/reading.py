"""The YAML of a sweep, checked before anything runs."""

import math
import pathlib
import re
from collections.abc import Callable
from typing import Any

from . import axes, lines, programs
from .mistakes import Mistakes
from .request import Sweep
from .values import Reader, Refused, shown

SCHEMA = "cyanometer-sweep/1"
STAGES = ("adu", "demosaicked", "xyz", "lab")
FRAMES_PER_JOB = (500, 5000)
LARGEST_SEED = 2**63 - 1
KEYS = {
    "schema", "output", "plots", "seed", "sensor_seed", "frames", "frames_per_job", "size", "f_number",
    "lens_transmittance", "matrix", "white_luminance_cd_per_m2", "stages", "sweep", "keep",
}  # fmt: skip


def read(name: str, text: str) -> Sweep:
    """Reads a sweep, or raises all mistakes that are in it."""
    reader = Reader(name, text)
    try:
        top = reader.keys((), reader.value, KEYS)
    except Refused:
        raise Mistakes(reader.in_order()) from None
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
    swept = axes.axes(reader, top.get("sweep"))
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
        **swept,
        keep=get("keep", None, lambda path, value: axes.keep(reader, path, value, frames, swept)),
    )
    _together(reader, sweep)
    if reader.told:
        raise Mistakes(reader.in_order())
    return sweep


def _output(reader: Reader, path: lines.Path, value: Any) -> str:
    name = reader.text(path, value)
    if pathlib.PurePath(name).suffix not in {".parquet", ".csv"}:
        raise reader.refuse(path, f"`{name}` ends in neither .parquet nor .csv")
    return name


def _size(reader: Reader, path: lines.Path, value: Any) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", value) if isinstance(value, str) else None
    if not match or any(int(side) < 12 or int(side) % 2 for side in match.groups()):
        raise reader.refuse(
            path, f"{shown(value)} is no size: give WIDTHxHEIGHT in photosites, each even and at least 12, such as 64x48"
        )
    return int(match[1]), int(match[2])


def _together(reader: Reader, sweep: Sweep) -> None:
    """What each value allows, but not all of them together."""
    known = programs.sensors()
    colors = bool({"xyz", "lab"} & set(sweep.stages)) or (sweep.keep is not None and sweep.keep.stage == "xyz")
    spectra = [sky.name for sky in sweep.skies if sky.file]
    here = ("sweep", "sensor")
    for sensor in sweep.sensors:
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
        for sky in sweep.skies:
            if sky.electrons:
                reader.note(
                    ("sweep", "sky"), f"{sky.name}: electrons given outright do not follow `expose_to`; give `exposure_s`"
                )
    if sweep.matrix.endswith((".yaml", ".yml")):
        if len(sweep.sensors) > 1:
            reader.note(
                ("matrix",),
                "one matrix does not fit several sensors; name a library of spectra, from which each gets its own",
            )
        if colors and "unit: cd m-2" not in pathlib.Path(sweep.matrix).read_text():
            reader.note(("matrix",), f"{sweep.matrix} gives no absolute XYZ, whose unit is cd m-2")
