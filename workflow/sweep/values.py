"""Values of a YAML file, read one by one; what is wrong with them is noted, so that all mistakes are told at once."""

import math
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

from . import lines
from .mistakes import choice


class Refused(Exception):
    """A value cannot be used; what was wrong is noted."""


class Nothing:
    """Stands for what could not be read."""


NOTHING = Nothing()


def kind_of(value: Any) -> str:
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


def shown(value: Any) -> str:
    return f"`{value}`" if isinstance(value, str) else str(value)


class Reader:
    """Reads values and notes what is wrong with them."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.value, self.lines = lines.load(name, text)
        self.told: list[tuple[int, str]] = []

    def note(self, path: lines.Path, what: str) -> None:
        """Notes a mistake at a place, or at the nearest around it."""
        near = path
        while near not in self.lines and near:
            near = near[:-1]
        where = ".".join(str(key + 1 if isinstance(key, int) else key) for key in path)
        line = self.lines.get(near, 1)
        self.told.append((line, f"{self.name}:{line}: {where + ': ' if where else ''}{what}"))

    def in_order(self) -> list[str]:
        """The mistakes, in the order of their lines."""
        return [what for _, what in sorted(self.told, key=lambda told: told[0])]

    def refuse(self, path: lines.Path, what: str) -> Refused:
        self.note(path, what)
        return Refused()

    def keys(self, path: lines.Path, value: Any, known: set[str]) -> dict[str, Any]:
        """A mapping with no other keys than these."""
        if not isinstance(value, dict):
            raise self.refuse(path, f"this is {kind_of(value)}; keys with values are wanted")
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
            raise self.refuse(path, f"{shown(value)} is {kind_of(value)}; a number is wanted")
        if not (math.isfinite(value) and (low < value if above else low <= value) and value <= high):
            least = f"above {low:g}" if above else f"at least {low:g}"
            raise self.refuse(
                path, f"{value} is out of range; it is {least}{f' and at most {high:g}' if high < math.inf else ''}"
            )
        return float(value)

    def whole(self, path: lines.Path, value: Any, low: int, high: int) -> int:
        """A whole number in a range."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.refuse(path, f"{shown(value)} is {kind_of(value)}; a whole number is wanted")
        if not low <= value <= high:
            raise self.refuse(path, f"{value} is out of range; it lies within {low} and {high}")
        return value

    def word(self, path: lines.Path, value: Any, known: Sequence[str]) -> str:
        """One of some words."""
        if not isinstance(value, str) or value not in known:
            raise self.refuse(path, f"{shown(value)} is unknown; {choice(str(value), known)}")
        return value

    def text(self, path: lines.Path, value: Any) -> str:
        if not isinstance(value, str) or not value:
            raise self.refuse(path, f"{shown(value)} is {kind_of(value)}; text is wanted")
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
            if read is not NOTHING:
                if read in found:
                    self.note(here, f"{shown(item)} stands twice")
                found.append(read)
        return tuple(found)

    def attempt(self, read: Callable[[], Any], otherwise: Any = None) -> Any:
        """What is read, or NOTHING where that is refused, so that other mistakes are found too."""
        try:
            return read()
        except Refused:
            return NOTHING if otherwise is None else otherwise

    def frames(self, path: lines.Path, value: Any) -> range:
        """A number of frames, or A..B, from A to the one before B."""
        match = re.fullmatch(r"(\d+)\.\.(\d+)", value) if isinstance(value, str) else None
        if match:
            found = range(int(match[1]), int(match[2]))
        elif isinstance(value, int) and not isinstance(value, bool):
            found = range(value)
        else:
            raise self.refuse(
                path, f"{shown(value)} is no range of frames; give a number, or A..B, from A to the one before B"
            )
        if not found or found.stop > 2**32:
            raise self.refuse(path, f"{shown(value)} is out of range: there is at least one frame, and none beyond 2^32")
        return found
