"""A scanning probe: a ball on a compliant beam that an arm holds, before a body."""

import numpy as np

from touchatlas.planner.tracking.machines import Reading
from touchatlas.sim.machine.carriage import Carriage
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import Beam


class BeamScanner(Carriage):
    """The quasi-static simulation of a ball on a beam; it is a ``Scanner`` of several tips.

    The ball has no inertia. It rests on the surface where the force of the beam lies in the cone of
    friction, and slides where it would leave the cone. Each tip has a body of its own.

    Parameters
    ----------
    feet : Feet
        Of the body.
    beam : Beam
    rng : numpy.random.Generator
    tips : int
        Driven side by side.

    Attributes
    ----------
    seconds : float, s
        What one machine would have taken for all tips, one after the other.
    time : float, s
        Of the readings.
    """

    def __init__(self, feet: Feet, beam: Beam, rng: np.random.Generator, tips: int = 6) -> None:
        super().__init__(feet, beam)
        self.beam, self._rng, self.tips, self.time = beam, rng, tips, 0.0
        self.place(np.zeros(3))

    def place(self, point) -> None:
        """All tips rest at a point (3,) in air."""
        self._holds = np.tile(np.asarray(point, float), (self.tips, 1))
        self._commanded, self._velocity = self._holds.copy(), np.zeros((self.tips, 3))
        self._balls, self._touches = self._holds.copy(), np.zeros(self.tips, bool)
        self._feet_now, self._seen = self._holds.copy(), self._holds.copy()
        self._gaps = np.zeros(self.tips)
        self._late: list[Reading] = []

    def position(self) -> np.ndarray:
        """(3,) centre of the first tip."""
        return self._balls[0]

    def command(self, velocity) -> None:
        """Move the held ends of the beams with velocities (tips, 3), length/s."""
        self._velocity = np.asarray(velocity, float)

    def read(self) -> Reading:
        """Advance by one period; the reading is that of some periods before."""
        beam, period = self.beam, 1.0 / self.beam.rate
        self.time += period
        # The same motion of all tips is one approach.
        moving = (self._velocity != 0.0).any(axis=1)
        together = (self._velocity == self._velocity[0]).all()
        self.seconds += period * float(moving.any() if together else moving.sum())
        self._commanded = self._commanded + self._velocity * period
        follow = 1.0 - np.exp(-2.0 * np.pi * beam.servo * period)
        self._holds = self._holds + follow * (self._commanded - self._holds)
        self._settle()
        noise = self._rng.normal(size=(2, *self._holds.shape))
        force = beam.stiffness * (self._balls - self._holds) + beam.force_std * noise[1]
        now = Reading(self.time, self._holds + beam.noise_std * noise[0], force)
        self._late.append(now)
        return self._late.pop(0) if len(self._late) > beam.late else self._late[0]

    def _settle(self) -> None:
        """Balls where forces balance: at the held ends where those are free, else on the surface
        within the cone of friction."""
        self._land()
        on = np.flatnonzero(self._touches)
        self._balls = np.where(self._touches[:, None], self._balls, self._holds)
        if not len(on):
            return
        beam, holds, balls, feet = self.beam, self._holds[on], self._balls[on], self._feet_now[on]
        # The second round slides on the tangent plane where the first one came to rest.
        for _ in range(2):
            balls, feet, normal = self._resting(balls, feet)
            pull = holds - balls
            press = -(pull * normal).sum(axis=1)
            along = pull + press[:, None] * normal
            length = np.sqrt((along * along).sum(axis=1))
            slip = 1.0 - beam.friction * np.maximum(press, 0.0) / np.maximum(length, 1e-300)
            balls = balls + np.maximum(slip, 0.0)[:, None] * along
        balls, feet, normal = self._resting(balls, feet)
        # Nothing sticks: a beam that pulls lifts its ball.
        held = ((holds - balls) * normal).sum(axis=1) < 0.0
        self._balls[on] = np.where(held[:, None], balls, holds)
        self._feet_now[on], self._touches[on[~held]] = feet, False

    def _land(self) -> None:
        """Find tips that meet the surface. A tip that moves by less than its last gap does not."""
        off = np.flatnonzero(~self._touches)
        moved = self._holds[off] - self._seen[off]
        near = (moved * moved).sum(axis=1) >= np.maximum(self._gaps[off], 0.0) ** 2
        if not near.any():
            return
        off = off[near]
        feet = self._feet.of(self._holds[off])
        away = self._holds[off] - feet
        self._gaps[off] = np.sqrt((away * away).sum(axis=1)) - self.beam.radius
        self._seen[off], self._feet_now[off] = self._holds[off], feet
        self._touches[off] = self._gaps[off] < 0.0

    def _resting(self, balls, feet):
        """Centres (n, 3) moved onto the surface that is a radius off the body's; feet, normals."""
        feet = self._feet.of(balls, feet)
        away = balls - feet
        normal = away / np.maximum(np.sqrt((away * away).sum(axis=1)), 1e-300)[:, None]
        return feet + self.beam.radius * normal, feet, normal
