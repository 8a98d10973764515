"""Going along a way through air, and back where something stops the tip."""

from typing import Protocol

import numpy as np


class Moves(Protocol):
    """A machine that moves: a ``Scanner`` or a ``Trigger``."""

    def move(self, way: np.ndarray) -> bool:
        """Go along a way; whether it arrived."""


def arrives(machine: Moves, start, way) -> bool:
    """Whether a machine comes from a start (3,) along a way (k, 3) to its end; it stays where the
    way is None.

    Where contact stops it, it goes back as it came: nothing else is known to be free there.
    """
    if way is None:
        return False
    gone = [np.asarray(start, float)]
    for point in np.asarray(way, float):
        if not machine.move(point[None]):
            machine.move(np.array(gone[::-1]))
            return False
        gone.append(point)
    return True
