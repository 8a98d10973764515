"""A plan carried out by a machine that scans: approach, then an arm each way in each plane."""

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import ContourEnd
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.arms import Arm, of_centres, touch_of, untracked
from touchatlas.planner.tracking.going import arrives
from touchatlas.planner.tracking.hybrid_control import (
    ControlState,
    centre_of,
    hybrid_control,
    leaving,
)
from touchatlas.planner.tracking.machines import Reading, Scanner
from touchatlas.planner.tracking.options import Tip, TrackingOptions
from touchatlas.planner.tracking.time_series import TimeSeries, samples_of

# Steps in which the surface has to be known before an arm may end there.
_KNOWN = 4


def track_plan(
    scanner: Scanner,
    plan: ProbePlan,
    tip: Tip = Tip(),
    options: TrackingOptions = TrackingOptions(),
    arms: list[Arm] | None = None,
    normals: bool = True,
) -> Touch:
    """Carry out a plan with a machine that scans.

    Parameters
    ----------
    scanner : Scanner
    plan : ProbePlan
    tip : Tip
    options : TrackingOptions
    arms : list, optional
        Takes what came of each arm, in the order of the planes, forward before backward.
    normals : bool
        Whether the force tells the normals of the surface. Without them a touch holds centres, as
        all touches of its atlas have to, and the plan is for the centre.

    Returns
    -------
    Touch
        Contacts with their normals, beside their planes: a ball whose centre stays in a plane meets
        a surface that leans out of it beside the plane. Its way is that of the centre. Without
        normals centres, in the planes in which they lay.

    Raises
    ------
    ValueError
        For a reading that is not finite or comes before the last one; the machine stands still.
    """
    radius = tip.radius if normals else 0.0
    origin, depth = plan.begin(radius), plan.depth
    # A tip travels along plane normal x surface normal: each plane is gone through both ways.
    across = np.array([plane.normal for plane in plan.planes])
    ways = np.stack([-across, across], axis=1).reshape(-1, 3)
    tips, found, status = getattr(scanner, "tips", 1), [], TouchStatus.TOUCHED
    here = centre_of(scanner.read(), tip).reshape(-1, 3)[0]
    way = plan.way_from(here, radius)
    travel = 0.0 if way is None else _length(np.vstack([here, way]))
    for first in range(0, len(ways), tips):
        tracker = _Tracker(scanner, plan, ways[first : first + tips], tip, options, radius)
        status = TouchStatus.UNREACHABLE
        if arrives(scanner, here, way):
            status = tracker.approach(origin, depth)
        if status is not TouchStatus.TOUCHED:
            break
        found += tracker.track()
        # Further arms begin where contact is known to be.
        above = tracker.start[0] + options.retract * plan.normal
        back = tracker.way_back(above)
        travel += _length(back)
        if not arrives(scanner, back[0], back[1:]):
            # The tip waits where the arm ended: nothing else is known to be free.
            status = TouchStatus.UNREACHABLE
            break
        here, way = above, above[None]
    if status is not TouchStatus.UNREACHABLE:
        scanner.move(origin[None])
    if found:
        # What was tracked before an arm could not be reached is kept.
        found += [untracked()] * (len(ways) - len(found))
        status = TouchStatus.TOUCHED
    if arms is not None:
        arms += found
    shared = float(np.hypot(tip.radius_std, options.force / tip.stiffness * tip.stiffness_std))
    touch = touch_of(plan, origin, depth, status, found, tip, travel, shared)
    return touch if normals else of_centres(touch, tip.radius)


class _Tracker:
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
        plan, options, count = self._plan, self._options, len(self._w)
        ends: list[ContourEnd | None] = [None] * count
        last, losses, lost = np.zeros(count, int), np.zeros(count, int), np.zeros(count, bool)
        first, known = np.zeros_like(self._w), _KnownSince(plan, count)
        assert self._state is not None
        # The last sample has readings to both sides.
        reach = plan.reach + 0.5 * options.window * options.feed
        patience = self._state.time + options.patience * plan.reach / options.feed
        patience += options.settle
        self._rows = []
        while None in ends:
            active = np.array([end is None for end in ends])
            reading = self._read()
            velocity = self._control(reading, active.astype(float))
            off = np.where(self._over[:, None], leaving(reading, options), 0.0)
            self._command(np.where((active & ~self._over)[:, None], velocity, off))
            state = self._state
            self._rows.append((reading.time, reading.position, reading.force, state.travelled))
            last[active] = len(self._rows)
            now = state.sought > 0.0
            losses += now & ~lost & active
            lost = now
            tangents = cross(self._w, state.normal)
            begins = (first == 0.0).all(axis=1) & (state.travelled >= 0.1 * plan.step)
            first[begins] = tangents[begins]
            turned = (tangents * first).sum(axis=1) < np.cos(plan.max_turn)
            turned &= (first != 0.0).any(axis=1) & ~lost
            centre = centre_of(reading, self._tip)
            away = np.sqrt(((centre - self.start) ** 2).sum(axis=1))
            contacts = centre - self._below * state.normal
            reasons = (
                (self._over, ContourEnd.OVERLOAD),
                (state.sought > options.search, ContourEnd.LOST_CONTACT),
                (turned, ContourEnd.TURNED_AWAY),
                (
                    (state.travelled > 4.0 * plan.step) & (away < 0.5 * plan.step),
                    ContourEnd.CLOSED_LOOP,
                ),
                (state.travelled >= reach, ContourEnd.LENGTH_REACHED),
                (known.long(contacts, state.travelled, active), ContourEnd.LENGTH_REACHED),
                (np.full(count, reading.time > patience), ContourEnd.UNREACHABLE),
            )
            for holds, end in reasons:
                for arm in np.flatnonzero(holds & active):
                    ends[arm] = ends[arm] or end
        self._leave()
        return [self._arm(k, last[k], end, losses[k]) for k, end in enumerate(ends) if end]

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

    def way_back(self, goal) -> np.ndarray:
        """(k, 3) from where the tip is to a goal (3,) above the contact, lifted over the places
        where it was."""
        # Side by side, all tips go back where the first one was.
        centres = np.array([p[0] + f[0] / self._tip.stiffness for _, p, f, _ in self._rows])
        travelled = np.array([gone[0] for *_, gone in self._rows])
        lifted = _lifted(centres, travelled, self._w[0], self._options.retract)
        return np.vstack([centres[-1:], lifted, goal])

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
        return Arm(series, samples, end, int(losses))

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


class _KnownSince:
    """Whether arms have been for some steps where their plan says that the surface is known; it is
    evaluated once a step."""

    def __init__(self, plan: ProbePlan, count: int) -> None:
        self._until, self._step = plan.until, plan.step
        self._next, self._steps = np.full(count, plan.step), np.zeros(count, int)

    def long(self, points, travelled, active) -> np.ndarray:
        """(m,) of arms at points (m, 3)."""
        due = active & (travelled >= self._next)
        if self._until is not None and due.any():
            self._next[due] += self._step
            far = travelled[due] > (_KNOWN + 0.5) * self._step
            known = np.asarray(self._until(points[due])) & far
            self._steps[due] = np.where(known, self._steps[due] + 1, 0)
        return np.asarray(self._steps > _KNOWN)


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


def _length(way) -> float:
    """Of straight lines through points (k, 3)."""
    return float(np.sqrt((np.diff(way, axis=0) ** 2).sum(axis=1)).sum())


def _lifted(centres, travelled, w, height: float) -> np.ndarray:
    """(k, 3) a path of centres (n, 3) gone back, lifted off the surface within its plane, with
    points about a height apart; ``travelled`` (n,) along it, length, which the noise of a tip at
    rest does not count in."""
    marks = np.floor(travelled / height).astype(int)
    places = np.flatnonzero(np.append(True, np.diff(marks) > 0))
    path = centres[places]
    if len(path) < 2:
        return np.zeros((0, 3))
    tangents = np.gradient(path, axis=0)
    up = cross(tangents, np.broadcast_to(w, tangents.shape))
    up /= np.maximum(np.sqrt((up * up).sum(axis=1)), 1e-300)[:, None]
    return (path + height * up)[::-1]
