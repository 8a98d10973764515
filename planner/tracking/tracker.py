"""Tips on the arms of one plan: contact, travel, and what was read on the way."""

import numpy as np

from touchatlas.atlas.records.touch import TouchStatus
from touchatlas.patch.geometry.contour import ContourEnd
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.arm_ends import ArmEnds
from touchatlas.planner.tracking.arms import Arm
from touchatlas.planner.tracking.hybrid_control import (
    ControlState,
    centre_of,
    hybrid_control,
    leaving,
)
from touchatlas.planner.tracking.machines import Reading, Scanner
from touchatlas.planner.tracking.time_series import TimeSeries, samples_of


class Tracker:
    """Some tips, side by side, on the arms of one plan; ``w`` (m, 3) are the normals of their
    planes, ``start`` (m, 3) their centres at the contact. What is learned lies a ``below``, length,
    under the centres: their radius, or nothing."""

    def __init__(self, scanner: Scanner, plan: ProbePlan, w, tip, options, below: float) -> None:
        self._scanner, self._plan, self._w = scanner, plan, w
        self._tip, self._options, self._below = tip, options, below
        self.start = np.tile(plan.reference_point, (len(w), 1))
        normal = plan.normal - (w @ plan.normal)[:, None] * w
        self._normal = normal / np.sqrt((normal * normal).sum(axis=1))[:, None]
        self._state: ControlState | None = None
        self._rows: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
        self._time = -np.inf
        # Tips whose force was too large.
        self._over = np.zeros(len(w), bool)

    def approach(self, origin, depth: float) -> TouchStatus:
        """Move against the normal until the force is half of its set point, and rest; whether all
        tips met the surface within the depth. A machine that does not move came to no place, and a
        force that is too large makes it one that cannot be touched."""
        options, normal = self._options, self._plan.normal
        met, patience = np.zeros(len(self._w), bool), np.inf
        while not met.all():
            reading = self._read()
            patience = min(patience, reading.time + options.patience * depth / options.approach)
            met |= np.sqrt((reading.force**2).sum(axis=1)) >= 0.5 * options.force
            if self._over.any():
                return self._give_up()
            if (((origin - reading.position) @ normal > depth) & ~met).any():
                self._command(np.zeros_like(self._w))
                return TouchStatus.NO_CONTACT
            if reading.time > patience:
                return self._give_up()
            self._command(np.where(met[:, None], 0.0, -options.approach * normal))
        reading = self._read()
        self._state = ControlState.at_rest(reading, self._normal, self._tip)
        self.start = centre_of(reading, self._tip)
        rested = reading.time + options.settle
        while reading.time < rested:
            reading = self._read()
            self._command(self._control(reading, 0.0))
            if self._over.any():
                return self._give_up()
        self.start = centre_of(reading, self._tip)
        return TouchStatus.TOUCHED

    def _give_up(self) -> TouchStatus:
        """Leave the surface, of a place that cannot be touched."""
        self._leave()
        return TouchStatus.UNREACHABLE

    def track(self) -> list[Arm]:
        """Travel until all arms have ended."""
        plan, options = self._plan, self._options
        assert self._state is not None
        # The last sample has readings to both sides.
        reach = plan.reach + 0.5 * options.window * options.feed
        patience = self._state.time + options.patience * plan.reach / options.feed
        ends = ArmEnds(plan, options, self._w, reach, patience + options.settle)
        last, self._rows = np.zeros(len(self._w), int), []
        while (active := ends.active).any():
            reading = self._read()
            velocity = self._control(reading, active.astype(float))
            off = np.where(self._over[:, None], leaving(reading, options), 0.0)
            self._command(np.where((active & ~self._over)[:, None], velocity, off))
            state, centre = self._state, centre_of(reading, self._tip)
            self._rows.append((reading.time, reading.position, reading.force, state.travelled))
            last[active] = len(self._rows)
            contacts = centre - self._below * state.normal
            ends.see(reading.time, state, centre - self.start, contacts, self._over)
        self._leave()
        return [self._arm(k, last[k], *end) for k, end in enumerate(ends.found())]

    def _leave(self) -> None:
        """Tips whose force was too large leave the surface; the others stand still."""
        options, end = self._options, np.inf
        while self._over.any():
            reading = self._read()
            end = min(end, reading.time + options.patience * options.retract / options.approach)
            away = np.where(self._over[:, None], leaving(reading, options), 0.0)
            if not away.any() or reading.time > end:
                break
            self._command(away)
        self._command(np.zeros_like(self._w))

    def travelled(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) centres of the first tip, and how far it had travelled at each (n,), length."""
        centres = np.array([p[0] + f[0] / self._tip.stiffness for _, p, f, _ in self._rows])
        return centres, np.array([gone[0] for *_, gone in self._rows])

    def _arm(self, arm: int, count: int, end: ContourEnd, losses: int) -> Arm:
        """The arm of a number, of its first readings."""
        plan, options = self._plan, self._options
        times, *rows = (np.array(column) for column in zip(*self._rows[:count], strict=True))
        # Before it slides, friction holds the tip, and the force has any direction in its cone.
        slides = rows[2][:, arm] >= 0.5 * options.force / self._tip.stiffness
        series = TimeSeries(times[slides], *(row[slides, arm] for row in rows))
        samples = samples_of(
            series,
            self._w[arm],
            self._tip,
            options.window,
            options.least,
            plan.step,
            plan.step_turn,
        )
        return Arm(series, samples, end, losses)

    def _control(self, reading: Reading, feed) -> np.ndarray:
        assert self._state is not None
        velocity, self._state = hybrid_control(
            reading, self.start, self._w, feed, self._tip, self._options, self._state
        )
        return velocity

    def _read(self) -> Reading:
        """The next reading, with arrays (m, 3)."""
        reading = self._scanner.read()
        if wrong := _wrong(reading, self._time):
            # A machine that is blind goes no further.
            self._command(np.zeros_like(self._w))
            raise ValueError(wrong)
        self._time = reading.time
        position, force = (np.reshape(x, (-1, 3)) for x in (reading.position, reading.force))
        position, force = position[: len(self._w)], force[: len(self._w)]
        self._over |= np.sqrt((force * force).sum(axis=1)) > self._options.most
        return Reading(reading.time, position, force)

    def _command(self, velocity: np.ndarray) -> None:
        tips = getattr(self._scanner, "tips", 0)
        if not tips:
            self._scanner.command(velocity[0])
            return
        rest = np.zeros((tips - len(velocity), 3))
        self._scanner.command(np.vstack([velocity, rest]))


def _wrong(reading: Reading, before: float) -> str:
    """What is wrong with a reading after one of a time before, s; empty where nothing is."""
    if not (np.isfinite(reading.position).all() and np.isfinite(reading.force).all()):
        return (
            f"the scanner reads the position {np.asarray(reading.position).tolist()} and the force "
            f"{np.asarray(reading.force).tolist()}; it must give finite numbers: see sensor and bus"
        )
    # What comes late may come twice.
    if not before <= reading.time < np.inf:
        return (
            f"the scanner reads a time of {reading.time!r} s after {before!r} s; give readings in "
            "their order, by a clock that runs forward"
        )
    return ""
