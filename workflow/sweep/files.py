"""Files that are there as a whole or not at all, and their BLAKE3."""

import contextlib
import os
import pathlib
from collections.abc import Iterator

import blake3
import yaml


@contextlib.contextmanager
def complete(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """Gives a name to write to, which becomes the file's own once all is written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        with part.open("rb") as written:
            os.fsync(written.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def digest(path: pathlib.Path) -> str:
    """BLAKE3 of a file, in hexadecimal."""
    return blake3.blake3().update_mmap(path).hexdigest() if path.stat().st_size else blake3.blake3().hexdigest()


def of_sensor(path: pathlib.Path) -> list[str]:
    """A sensor file and the tables beside it that it names; nothing of a sensor that is known by name."""
    if not path.is_file():
        return []
    named = _tables(yaml.safe_load(path.read_text())) if path.suffix in (".yaml", ".yml") else []
    return [str(path), *(str(table) for table in (path.parent / name for name in named) if table.is_file())]


def _tables(value: object) -> list[str]:
    """What stands behind the keys `file`, wherever they are."""
    if not isinstance(value, dict):
        return []
    own = [value["file"]] if isinstance(value.get("file"), str) else []
    return own + [name for inner in value.values() for name in _tables(inner)]


def keyed(*words: object) -> str:
    """BLAKE3 of some words in their order."""
    return blake3.blake3("\0".join(str(word) for word in words).encode()).hexdigest()
