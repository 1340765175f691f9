"""What the installed programs are and know."""

import dataclasses
import functools
import re
import shutil
import subprocess

from .mistakes import Mistakes

PROGRAMS = (
    "cyanometer", "render-radiance", "mosaic", "add-noise", "digitize", "demosaic", "fit-matrix", "to-xyz", "measure",
    "predict-noise",
)  # fmt: skip
METHODS = ("bi", "shti", "eci", "mhc")


@dataclasses.dataclass(frozen=True)
class Known:
    """What `cyanometer list sensors` says of a sensor."""

    response: str
    has_readout: bool


def output(*command: str) -> str:
    """What a program says."""
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def check() -> None:
    """Refuses to begin without the programs."""
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    if missing:
        raise Mistakes([f"not on the PATH: {', '.join(missing)}; install cyanometer, or add the directory of its programs"])


@functools.cache
def version() -> str:
    """Version of the programs, on which their samples may depend."""
    return output("cyanometer", "--version").strip()


@functools.cache
def sensors() -> dict[str, Known]:
    """The sensors that are known by name, and by their other names."""
    found = {}
    for line in output("cyanometer", "list", "sensors").splitlines()[2:]:
        columns = re.split(r" {2,}", line.strip())
        if len(columns) < 5:
            continue
        known = Known(columns[2], not columns[3].startswith("none"))
        also = columns[4].partition("; also ")[2]
        for name in [columns[0], *filter(None, also.split(", "))]:
            found[name] = known
    return found
