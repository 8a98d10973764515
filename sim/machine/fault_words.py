"""Faults of a probe as words: noise=3,moved=5:touch5."""

import re
from typing import NamedTuple

NOISE, TIP, PLANE, DISPLACED, DRIFT, MOVED, OUTLIERS, LOST = (
    *("noise", "tip", "plane", "displaced", "drift", "moved", "outliers", "lost"),
)
NAMES = (NOISE, TIP, PLANE, DISPLACED, DRIFT, MOVED, OUTLIERS, LOST)
_WORD = re.compile(r"(\w+)=([0-9.eE+-]+)(?::touch(\d+))?")


class Fault(NamedTuple):
    """One fault: its name, how large it is, and the number of the touch that it begins with."""

    name: str
    size: float
    begins: int = 0


def faults_of(words: str) -> tuple[Fault, ...]:
    """The faults that a text names, in its order; each can begin at a touch.

    Raises
    ------
    ValueError
        When the text is no list of faults.

    Examples
    --------
    >>> faults_of("noise=3,moved=5:touch4")[1]
    Fault(name='moved', size=5.0, begins=4)
    """
    if not isinstance(words, str):
        raise ValueError(f"fault is {words!r}; it must be text, as noise=3,moved=5:touch4")
    return tuple(_fault_of(word.strip()) for word in words.split(",") if word.strip())


def _fault_of(word: str) -> Fault:
    found = _WORD.fullmatch(word)
    try:
        size = float(found[2]) if found else -1.0
    except ValueError:
        size = -1.0
    if found is None or found[1] not in NAMES or not 0.0 <= size < float("inf"):
        raise ValueError(
            f"fault is {word!r}; it must be a name, = and a size of 0 or more, as noise=3, and may "
            f"end with the touch that it begins with, as :touch5; names are {', '.join(NAMES)}"
        )
    if found[1] in (OUTLIERS, LOST) and size > 1.0:
        raise ValueError(f"fault is {word!r}; a share is 1 at most")
    return Fault(found[1], size, int(found[3] or 0))
