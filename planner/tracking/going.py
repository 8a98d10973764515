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

    Raises
    ------
    ValueError
        When ``move`` does not say whether it arrived.
    """
    if way is None:
        return False
    gone = [np.asarray(start, float)]
    for point in np.asarray(way, float):
        arrived = machine.move(point[None])
        if not isinstance(arrived, bool | np.bool_):
            raise ValueError(
                f"move returned {arrived!r}; it must return True where it arrived, and False where "
                "contact stopped it"
            )
        if not arrived:
            machine.move(np.array(gone[::-1]))
            return False
        gone.append(point)
    return True
