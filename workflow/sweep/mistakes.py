"""What is wrong with a sweep, in plain words, all of it at once."""

import difflib
from collections.abc import Iterable


class Mistakes(Exception):
    """Each mistake is a line."""

    def __init__(self, told: Iterable[str]) -> None:
        self.told = list(told)
        super().__init__("\n".join(self.told))


def choice(word: str, known: Iterable[str]) -> str:
    """Says what there is to choose from, or the one name that was probably meant."""
    known = list(known)
    near = difflib.get_close_matches(word, known, n=1)
    if near:
        return f"did you mean `{near[0]}`?"
    return f"it is one of {', '.join(known)}" if len(known) <= 12 else f"{len(known)} are known"
