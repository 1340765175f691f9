"""Files that are there as a whole or not at all, and their BLAKE3."""

import contextlib
import os
import pathlib
from collections.abc import Iterator

import blake3


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


def keyed(*words: object) -> str:
    """BLAKE3 of some words in their order."""
    return blake3.blake3("\0".join(str(word) for word in words).encode()).hexdigest()
