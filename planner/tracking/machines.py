"""What a machine has to do: two protocols, one for probes that scan, one for probes that trigger.

All positions are those of the centre of the tip, in the frame and unit of the plans.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, eq=False)
class Reading:
    """What a scanner reads at one time.

    Parameters
    ----------
    time : float, s
        Of a clock that only runs forward.
    position : (..., 3) float, length, world
        Where the centre of the tip is if the stylus is not bent.
    force : (..., 3) float, N, world
        By the surface on the tip: it points out of the body.
    """

    time: float
    position: np.ndarray
    force: np.ndarray


class Scanner(Protocol):
    """A machine that reads pose and force, and follows commanded velocities.

    A machine has one tip, and all its arrays are (3,). A simulation may drive several ones side by
    side, each before a body of its own: it has a number ``tips``, and arrays (tips, 3).
    """

    def move(self, way: np.ndarray) -> bool:
        """Go along the straight lines through points (k, 3) in air, and rest at the last one.

        Returns
        -------
        bool
            Whether it arrived; False where contact stopped it.
        """

    def read(self) -> Reading:
        """Wait for the next reading."""

    def command(self, velocity: np.ndarray) -> None:
        """Move the unbent centre of the tip with this velocity (..., 3), length/s, until told
        otherwise."""


class Trigger(Protocol):
    """A machine that stops where its tip meets a surface, and says where."""

    def move(self, way: np.ndarray) -> bool:
        """Go along the straight lines through points (k, 3) in air, and rest at the last one.

        Returns
        -------
        bool
            Whether it arrived; False where contact stopped it.
        """

    def position(self) -> np.ndarray:
        """(3,) centre of the tip now."""

    def probe(self, target: np.ndarray) -> np.ndarray | None:
        """Go straight to a target (3,) until the tip meets something.

        Returns
        -------
        (3,) float, length, world, or None
            Centre of the tip where the machine triggered; None where it met nothing.
        """
