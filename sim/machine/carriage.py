"""A machine of three axes that carries a ball through air, and stops where it meets the body."""

import numpy as np

from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import Beam, Switch


class Carriage:
    """What scanners and triggers share.

    Parameters
    ----------
    feet : Feet
        Of the body.
    ball : Beam or Switch
        Whose ball it is, with the pace of the machine.

    Attributes
    ----------
    seconds : float, s
        That the machine has taken.
    collisions : int
        Ways on which the ball met the body.
    """

    def __init__(self, feet: Feet, ball: Beam | Switch) -> None:
        self._feet, self._ball, self.seconds, self.collisions = feet, ball, 0.0, 0

    def place(self, point) -> None:
        """The ball rests at a point (3,) in air."""
        raise NotImplementedError

    def position(self) -> np.ndarray:
        """(3,) centre of the ball."""
        raise NotImplementedError

    def move(self, way) -> bool:
        """Go through points (k, 3) in air; where the ball meets the body, it stops."""
        for point in np.reshape(np.asarray(way, float), (-1, 3)):
            start = self.position()
            length = float(np.linalg.norm(point - start))
            free = self._feet.free_length(start, point, self._ball.radius)
            gone = min(free, length)
            self.seconds += gone / self._ball.rapid + self._ball.pause
            if free < length:
                self.collisions += 1
                self.place(start + gone / length * (point - start))
                return False
            self.place(point)
        return True
