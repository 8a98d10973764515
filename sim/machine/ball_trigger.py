"""A trigger probe: a ball that stops where it meets a body; it is a ``Trigger``."""

import numpy as np

from touchatlas.sim.machine.carriage import Carriage
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import Switch


class BallTrigger(Carriage):
    """The simulation of a ball with a switch on a machine of three axes.

    Parameters
    ----------
    feet : Feet
        Of the body.
    switch : Switch
    rng : numpy.random.Generator

    Attributes
    ----------
    centre : (3,) float, length
        Of the ball.
    """

    def __init__(self, feet: Feet, switch: Switch, rng: np.random.Generator) -> None:
        super().__init__(feet, switch)
        self.switch, self._rng, self.centre = switch, rng, np.zeros(3)

    def place(self, point) -> None:
        """The ball rests at a point (3,) in air."""
        self.centre = np.array(point, float)

    def position(self) -> np.ndarray:
        """(3,) centre of the ball."""
        return self.centre

    def probe(self, target) -> np.ndarray | None:
        """Go straight to a target (3,) until the switch opens; the centre (3,) there, or None."""
        switch, way = self.switch, np.asarray(target, float) - self.centre
        length = float(np.linalg.norm(way))
        direction = way / max(length, 1e-300)
        free = self._feet.free_length(self.centre, target, switch.radius)
        self.seconds += min(free, length) / switch.feed + switch.pause
        if free >= length:
            self.centre = np.array(target, float)
            return None
        x, y, _ = direction
        late = switch.travel + switch.lobes * np.hypot(x, y) * np.cos(3.0 * np.arctan2(y, x))
        late += switch.noise_std * self._rng.normal()
        late += switch.feed * switch.period * self._rng.random()
        self.centre = self.centre + (free + max(late, 0.0)) * direction
        if not switch.step:
            return self.centre.copy()
        return np.asarray(np.round(self.centre / switch.step) * switch.step)
