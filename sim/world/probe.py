"""The simulated touch probe: carries out a ProbePlan on an object."""

import json

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.arrays import cross
from touchatlas.planner import ProbePlan
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# The approach starts this far above the reference point and ends this far below: in reaches, or in
# steps if that is less. Doubled, the probe travels farther and finds places that were predicted
# less well.
_APPROACH, _STEPS = 0.5, 10.0
# An arm ends where the surface has been known for this number of samples, at least as many from the
# contact. Doubled, arms run on over what is known.
_IN_A_ROW, _LEAST = 5, 4


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
        lift = min(_APPROACH * plan.reach, _STEPS * plan.step)
        origin = plan.reference_point + lift * plan.normal
        travel = 0.0
        if self._position is not None:
            travel = float(np.linalg.norm(origin - self._position))
        contact = self._object.contact(origin, -plan.normal, 2.0 * lift)
        if contact is None:
            self._position = origin
            return Touch(
                plan.number,
                plan.reference_point,
                plan.normal,
                (),
                TouchStatus.NO_CONTACT,
                0.0,
                travel,
            )
        travel += float(np.linalg.norm(contact - origin))
        self._position = contact
        contours, tracked = self._track(contact, plan)
        measured = contact + self._noise * self._rng.normal(size=3)
        return Touch(
            plan.number, measured, plan.normal, contours, TouchStatus.TOUCHED, tracked, travel
        )

    def _track(self, contact, plan: ProbePlan):
        normals = np.array([plane.normal for plane in plan.planes])
        forward = cross(plan.normal[None], normals)
        arms = self._object.trace_arms(
            contact,
            np.concatenate([normals, normals]),
            np.concatenate([forward, -forward]),
            plan.reach,
            plan.step,
            plan.max_turn,
        )
        arms = [_ended(points, end, plan.until) for points, end in arms]
        contours, tracked = [], 0.0
        count = len(normals)
        for ahead, behind, normal in zip(arms[:count], arms[count:], normals, strict=True):
            points = np.concatenate([behind[0][::-1], contact[None], ahead[0]])
            if ahead[1] is ContourEnd.CLOSED_LOOP:
                points = points[len(behind[0]) :]
            points = points + self._noise * self._rng.normal(size=points.shape)
            contours.append(
                Contour(points, SamplingPlane(contact, normal), self._noise, (behind[1], ahead[1]))
            )
            tracked += (len(points) - 1) * plan.step
        return tuple(contours), tracked

    def state(self) -> str:
        """Place and random numbers of the probe, as JSON; ``restore`` takes it."""
        position = None if self._position is None else self._position.tolist()
        return json.dumps({"position": position, "random": self._rng.bit_generator.state})

    def restore(self, state: str) -> None:
        """Go on from a state, as if all touches before had been made; ValueError if it is none."""
        try:
            known = json.loads(state)
            position = known["position"]
            self._rng.bit_generator.state = known["random"]
        except (ValueError, TypeError, KeyError) as error:
            raise ValueError(
                f"the probe's state cannot be read ({error!r}); explore again"
            ) from None
        self._position = None if position is None else np.array(position, float)


def _ended(points, end: ContourEnd, until):
    """An arm, points (n, 3) and its end, up to where the surface has been known for some samples.

    A real probe asks while it tracks; the result is the same.
    """
    if until is None or end is ContourEnd.CLOSED_LOOP or len(points) <= _LEAST + _IN_A_ROW:
        return points, end
    known = np.asarray(until(points), bool)
    runs = np.lib.stride_tricks.sliding_window_view(known[_LEAST:], _IN_A_ROW).all(axis=1)
    if not runs.any():
        return points, end
    return points[: _LEAST + int(runs.argmax()) + _IN_A_ROW], ContourEnd.LENGTH_REACHED
