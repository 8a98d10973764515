"""The methods that are walked up to each cliff, all with the same answer: an ``Answer``."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchatlas.patch import FitOptions, Patch, Penalty, diagnose, fit_paper, fit_patch
from touchatlas.patch.geometry.contour import Contour
from touchatlas.sim.study.peers import fit_jet
from touchatlas.sim.study.stability.case import Case, Shape

# The paper's multiplier, 0.3 mm^2 at a radius of 20 mm, and free of units for other radii.
_CORE = FitOptions().core


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method says about the surface.

    Parameters
    ----------
    origin : (3,) float, length, world
        Where it gives normal and curvatures.
    core : float, length
        It claims the surface within this distance of the origin.
    distance, deviation : callable
        Points (n, 3) to the distance from the found surface (n,) and to its predicted standard
        deviation (n,); the latter is None where a method predicts none.
    shape : Shape
        Normal and curvatures at the origin.
    normal_std, curvature_std : float, rad and 1/length
        Their predicted deviations; NaN where there are none.
    doubts : tuple of str
        Words of its diagnosis; empty where nothing is doubtful.
    """

    origin: np.ndarray
    core: float
    distance: Callable[[np.ndarray], np.ndarray]
    deviation: Callable[[np.ndarray], np.ndarray] | None
    shape: Shape
    normal_std: float
    curvature_std: float
    doubts: tuple[str, ...]


def _of_patch(patch: Patch, contours: tuple[Contour, ...]) -> Answer:
    known, orders = patch.curvatures, patch.polynomial.basis.orders
    slopes = np.diagonal(patch.covariance)[orders == 1][:2]
    return Answer(
        patch.frame.origin,
        patch.core * patch.radius,
        patch.signed_distance,
        patch.deviation,
        Shape(patch.frame.normal, known.k1, known.k2),
        float(np.sqrt(slopes.sum())),
        float(np.sqrt(np.mean(known.std**2))),
        diagnose(patch, contours).doubts,
    )


def _ours(case: Case) -> Answer:
    contours = case.contours()
    return _of_patch(fit_patch(case.point, contours, case.outward).patch, contours)


def _paper(penalty: Penalty) -> Callable[[Case], Answer]:
    def answer(case: Case) -> Answer:
        contours = case.contours()
        return _of_patch(fit_paper(case.point, contours, case.outward, penalty), contours)

    return answer


def _jet(degree: int) -> Callable[[Case], Answer]:
    def answer(case: Case) -> Answer:
        samples = np.concatenate([track.points for track in case.tracks])
        jet = fit_jet(case.point, samples, case.outward, degree)
        normal = np.array([-jet.coefficients[1], -jet.coefficients[2], 1.0])
        foot = jet.origin + jet.coefficients[0] * jet.axes[2]
        shape = Shape(normal / np.linalg.norm(normal) @ jet.axes, jet.k1, jet.k2)
        core = _CORE * case.reach
        return Answer(foot, core, jet.height_error, None, shape, np.nan, np.nan, ())

    return answer


METHODS: dict[str, Callable[[Case], Answer]] = {
    "map": _ours,
    "total_curvature": _paper(Penalty.TOTAL_CURVATURE),
    "least_squares": _paper(Penalty.NONE),
    "jet_2": _jet(2),
    "jet_4": _jet(4),
}
