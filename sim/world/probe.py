"""The simulated touch probe: carries out a ProbePlan on an object."""

import json
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.order import out_of_order
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.planner import ProbePlan
from touchatlas.sim.world.finer_steps import HALVINGS
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# Points (n, 3) of an arm, and why it ends.
Arm = tuple[np.ndarray, ContourEnd]


class Probe:
    """A probe with Gaussian position noise.

    Parameters
    ----------
    obj : ImplicitObject or MeshObject
    noise_std : float, length, >= 0
        Of each coordinate of each reported point.
    rng : numpy.random.Generator
    """

    def __init__(self, obj: ImplicitObject | MeshObject, noise_std: float, rng) -> None:
        if not (np.isfinite(noise_std) and noise_std >= 0):
            raise ValueError(f"noise is {noise_std}; it must be a length >= 0")
        self._object, self._noise, self._rng = obj, float(noise_std), rng
        self._position: np.ndarray | None = None

    def __call__(self, plan: ProbePlan) -> Touch:
        """Approach along the planned normal, then track in every planned plane."""
        lift = plan.approach or plan.usual_approach
        origin = plan.reference_point + lift * plan.normal
        travel = 0.0
        if self._position is not None:
            travel = float(np.linalg.norm(origin - self._position))
        if self._object.is_inside(origin):
            return self._in_vain(plan, TouchStatus.UNREACHABLE, 0.0)
        length = lift + max(lift, plan.usual_approach)
        contact = self._object.contact(origin, -plan.normal, length)
        if contact is None:
            self._position = origin
            way = _way(origin, length, plan)
            return self._in_vain(plan, TouchStatus.NO_CONTACT, travel, way)
        travel += float(np.linalg.norm(contact - origin))
        self._position = contact
        contours, tracked = self._track(contact, plan)
        measured = contact + self._noise * self._rng.normal(size=3)
        return Touch(
            plan.number,
            measured,
            plan.normal,
            contours,
            TouchStatus.TOUCHED,
            tracked,
            travel,
            _way(origin, float((origin - measured) @ plan.normal), plan),
        )

    def _in_vain(self, plan: ProbePlan, status: TouchStatus, travel: float, way=None) -> Touch:
        """The touch of a plan without contact."""
        return Touch(plan.number, plan.reference_point, plan.normal, (), status, 0.0, travel, way)

    def _track(self, contact, plan: ProbePlan):
        normals = np.array([plane.normal for plane in plan.planes])
        forward = cross(plan.normal[None], normals)
        arms = self._arms(contact, normals, forward, plan, plan.step)
        count = len(normals)
        for k in range(count):
            if _is_shuffled(contact, arms[k], arms[count + k]):
                arms[k], arms[count + k] = self._in_order(contact, normals[k], forward[k], plan)
        known = _known_along([points for points, _ in arms], plan)
        arms = [
            _ended(contact, points, end, along, plan.step)
            for (points, end), along in zip(arms, known, strict=True)
        ]
        contours, tracked = [], 0.0
        for ahead, behind, normal in zip(arms[:count], arms[count:], normals, strict=True):
            points = _joined(contact, ahead, behind)
            points = points + self._noise * self._rng.normal(size=points.shape)
            contours.append(
                Contour(points, SamplingPlane(contact, normal), self._noise, (behind[1], ahead[1]))
            )
            tracked += sum(_lengths(contact, arm)[-1:].sum() for arm in (ahead[0], behind[0]))
        return tuple(contours), tracked

    def _arms(self, contact, normals, forward, plan: ProbePlan, step: float) -> list[Arm]:
        """The arms ahead in planes with normals (m, 3), and then those behind."""
        planes, ways = np.concatenate([normals, normals]), np.concatenate([forward, -forward])
        turns = plan.max_turn, plan.step_turn
        return list(self._object.trace_arms(contact, planes, ways, plan.reach, step, *turns))

    def _in_order(self, contact, normal, forward, plan: ProbePlan) -> list[Arm]:
        """The arms of a contour whose steps jump between two sides of a thin body: in shorter
        steps, which follow one side; without samples where none does."""
        for halving in range(1, HALVINGS + 1):
            step = plan.step * 0.5**halving
            arms = self._arms(contact, normal[None], forward[None], plan, step)
            if not _is_shuffled(contact, *arms):
                return arms
        return [(np.zeros((0, 3)), ContourEnd.TURNED_AWAY)] * 2

    def state(self) -> str:
        """Place and random numbers of the probe, as JSON; ``restore`` takes it."""
        position = None if self._position is None else self._position.tolist()
        return json.dumps({"position": position, "random": self._rng.bit_generator.state})

    def restore(self, state: str) -> None:
        """Go on from a state, as if all touches before had been made; ValueError if it is none."""
        with state_of(state) as known:
            position = known["position"]
            self._rng.bit_generator.state = known["random"]
            self._position = None if position is None else np.array(position, float)


@contextmanager
def state_of(text: str) -> Iterator[dict]:
    """What the state of a probe says; ValueError where the block cannot take it."""
    try:
        yield json.loads(text)
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"the probe's state cannot be read ({error!r}); explore again") from None


def _joined(contact, ahead: Arm, behind: Arm) -> np.ndarray:
    """(n, 3) points of a contour in order of travel: of a closed loop those of one arm."""
    if ahead[1] is ContourEnd.CLOSED_LOOP:
        return np.concatenate([contact[None], ahead[0]])
    return np.concatenate([behind[0][::-1], contact[None], ahead[0]])


def _is_shuffled(contact, ahead: Arm, behind: Arm) -> bool:
    """Whether a touch would refuse a contour as one in no order of travel."""
    points = _joined(contact, ahead, behind)
    return len(points) >= LEAST_POINTS and out_of_order(points)


def _way(origin, length: float, plan: ProbePlan) -> np.ndarray | None:
    """Ends (2, 3) of a way of a length against the planned normal; None of no length: noise may
    place a contact above where a short approach began."""
    return np.stack([origin, origin - length * plan.normal]) if length > 0.0 else None


def _known_along(arms, plan: ProbePlan) -> list[np.ndarray]:
    """(n,) whether the surface is known at the points (n, 3) of each arm.

    A real probe asks while it tracks; the result is the same.
    """
    points = np.concatenate(arms)
    known = np.zeros(len(points), bool)
    if plan.until is not None and len(points):
        known[:] = plan.until(points)
    return np.split(known, np.cumsum([len(arm) for arm in arms])[:-1])


def _ended(contact, points, end: ContourEnd, known, step: float):
    """An arm, points (n, 3) and its end, up to where the surface has been known (n,) for some
    steps."""
    if end is ContourEnd.CLOSED_LOOP or not len(points):
        return points, end
    steps = _lengths(contact, points) / step
    # The halves keep clear of whole numbers of steps.
    known = known & (steps > 4.5)
    # The last sample before each that is not known.
    before = np.maximum.accumulate(np.where(known, -1, np.arange(len(steps))))
    began = steps[np.minimum(before + 1, len(steps) - 1)]
    stop = np.flatnonzero(known & (steps - began > 3.5))
    if not len(stop):
        return points, end
    return points[: stop[0] + 1], ContourEnd.LENGTH_REACHED


def _lengths(contact, points) -> np.ndarray:
    """(n,) arc lengths from the contact to the points (n, 3) of an arm, along its chords."""
    steps = np.diff(np.vstack([contact[None], points]), axis=0)
    out: np.ndarray = np.cumsum(np.sqrt((steps**2).sum(axis=1)))
    return out
