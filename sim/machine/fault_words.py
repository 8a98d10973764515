"""Faults of a probe as words: noise=3,moved=5:touch5."""

import re
from typing import NamedTuple

import numpy as np

NOISE, TIP, PLANE, DISPLACED, DRIFT, MOVED, OUTLIERS, LOST = (
    *("noise", "tip", "plane", "displaced", "drift", "moved", "outliers", "lost"),
)
NAMES = (NOISE, TIP, PLANE, DISPLACED, DRIFT, MOVED, OUTLIERS, LOST)
# Shares; degrees, because contours that are turned more are in no plane; and times the noise.
_MOST = {OUTLIERS: 1.0, LOST: 1.0, PLANE: 30.0, NOISE: 1000.0}
_WORD = re.compile(r"(\w+)=([0-9.eE+-]+)(?::touch(\d+))?")


class Fault(NamedTuple):
    """One fault: its name, how large it is, and the number of the touch that it begins with."""

    name: str
    size: float
    begins: int = 0


def faults_of(words: str) -> tuple[Fault, ...]:
    """The faults that a text names, in its order, with commas between them; each can begin at a
    touch.

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
    found = tuple(_fault_of(word.strip()) for word in words.split(",")) if words.strip() else ()
    names = [fault.name for fault in found]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"fault is {words!r}; it names {name} twice: give each fault once")
    return found


def check_lengths(words: str, tolerance: float, diagonal: float) -> None:
    """ValueError for a fault by more than the diagonal, length, of the object."""
    for fault in faults_of(words):
        unit = {TIP: 1.0, **dict.fromkeys((DISPLACED, DRIFT, MOVED), tolerance)}.get(fault.name)
        if unit and fault.size * unit > diagonal:
            raise ValueError(
                f"fault is {words!r}; {fault.name} is {diagonal / unit:.4g} at most, the diagonal "
                f"of the object{'' if fault.name == TIP else ' in tolerances'}"
            )


def never_began(words: str, touches: int) -> str:
    """Faults that begin after a number of touches, in words; "" where there is none.

    >>> never_began("noise=3:touch9,tip=1", 4)
    'noise=3:touch9'
    """
    late = [fault for fault in faults_of(words) if fault.begins >= max(touches, 1)]
    return ", ".join(f"{fault.name}={fault.size:g}:touch{fault.begins}" for fault in late)


def _fault_of(word: str) -> Fault:
    found = _WORD.fullmatch(word)
    try:
        size = float(found[2]) if found else -1.0
    except ValueError:
        size = -1.0
    if found is None or found[1] not in NAMES or not 0.0 <= size < float("inf"):
        raise ValueError(
            f"fault is {word!r}; it must be a name, = and a size of 0 or more, as noise=3, and may "
            "end with the touch that it begins with, as :touch5; there are commas between several, "
            f"and names are {', '.join(NAMES)}"
        )
    name, begins = found[1], int(found[3] or 0)
    if size > _MOST.get(name, np.inf):
        raise ValueError(f"fault is {word!r}; {name} is {_MOST[name]:g} at most")
    if name == MOVED and not begins:
        raise ValueError(
            f"fault is {word!r}; give the touch before which the object moves, 1 or more, as "
            f"{name}={found[2]}:touch5"
        )
    return Fault(name, size, begins)
