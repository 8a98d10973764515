"""Methods for one patch on a case: what each says of the surface, and the law that judges it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchatlas.patch import FitOptions, Patch, Penalty, diagnose
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.study.cases import Case
from touchatlas.sim.study.fits import FITS, Fit, Jet, papers
from touchatlas.sim.study.heights import Shape
from touchatlas.sim.study.outcome import Outcome, Verdict, attempted, outcome_of


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
    normal_std: float = np.nan
    curvature_std: float = np.nan
    doubts: tuple[str, ...] = ()


def answered(fit: Fit) -> Callable[[Case], Answer]:
    """A fit as a method: a case to its answer."""

    def answer(case: Case) -> Answer:
        contours = case.contours()
        found = fit(case.point, contours, case.outward)
        if isinstance(found, Patch):
            return _of_patch(found, contours)
        return _of_jet(found, FitOptions().core * case.reach)

    return answer


def _of_patch(patch: Patch, contours) -> Answer:
    known, orders = patch.curvatures, patch.polynomial.basis.orders
    slopes = np.diagonal(patch.covariance)[orders == 1][:2]
    return Answer(
        *(patch.frame.origin, patch.core * patch.radius, patch.signed_distance, patch.deviation),
        *(Shape(patch.frame.normal, known.k1, known.k2), float(np.sqrt(slopes.sum()))),
        *(float(np.sqrt(np.mean(known.std**2))), diagnose(patch, contours).doubts),
    )


def _of_jet(jet: Jet, core: float) -> Answer:
    normal = np.array([-jet.coefficients[1], -jet.coefficients[2], 1.0])
    foot = jet.origin + jet.coefficients[0] * jet.axes[2]
    shape = Shape(normal / np.linalg.norm(normal) @ jet.axes, jet.k1, jet.k2)
    return Answer(foot, core, jet.height_error, None, shape)


# The paper's multiplier is free of units here: 0.3 mm^2 at a radius of 20 mm.
METHODS: dict[str, Callable[[Case], Answer]] = {
    "map": answered(FITS["map"]),
    "total_curvature": answered(papers(Penalty.TOTAL_CURVATURE, None)),
    "least_squares": answered(FITS["least_squares"]),
    "jet_2": answered(FITS["jet_2"]),
    "jet_4": answered(FITS["jet_4"]),
}


@dataclass(frozen=True)
class Law:
    """Limits of the law.

    Parameters
    ----------
    noises : float
        An error of so many noises is good whatever was predicted.
    vague : float
        A predicted deviation above this fraction of the core tells nothing: a slope of three
        degrees.
    rounding : float
        Rounding of exact contacts over the reach: the fits take noise to be no less.
    """

    noises: float = 3.0
    vague: float = 0.05
    rounding: float = 1e-6


def verdict(method: Callable[[Case], Answer], case: Case) -> Verdict:
    """Run a method on a case and judge it."""
    return attempted(lambda: judge(method(case), case))


def judge(answer: Answer, case: Case, law: Law = Law()) -> Verdict:
    """The law of one patch.

    Three errors are compared, all as lengths at the core radius c: the root mean square distance
    of the true surface from the found one within c of its origin; c times the angle of the
    normals; c^2/2 times the root mean square error of the two curvatures. Each must be within
    1.96 predicted standard deviations of the same quantity, or within 3 noises. A case of which
    all three are is good, but for one that is held only by a deviation of more than a twentieth of
    c: its own deviation flags it.
    """
    points = case.truth.around(answer.origin, answer.core)
    distance = answer.distance(points)
    shape, core = case.truth.at(answer.origin), answer.core
    angle = np.arctan2(
        np.linalg.norm(np.cross(shape.normal, answer.shape.normal)),
        shape.normal @ answer.shape.normal,
    )
    bends = [answer.shape.k1 - shape.k1, answer.shape.k2 - shape.k2]
    errors = np.array([_rms(distance), core * angle, 0.5 * core**2 * _rms(bends)])
    predicted, held = _predicted(answer, points, distance)
    unit = max(case.noise_std, law.rounding * case.reach)
    far = errors > law.noises * unit
    held_by = far & (errors <= SURE * np.nan_to_num(predicted))
    finite = bool(np.isfinite(errors).all() and not np.isinf(predicted).any())
    outcome = outcome_of(not (far & ~held_by).any(), answer.doubts, finite)
    if outcome is Outcome.GOOD and (held_by & (predicted > law.vague * core)).any():
        outcome = Outcome.FLAGGED
    return Verdict(
        *(outcome, float(errors[0] / unit), tuple((errors / predicted).tolist()), held),
        *(float(core / case.reach), answer.doubts),
    )


def _predicted(answer: Answer, points, distance):
    """Deviations of the three errors, and the fraction of the points within 1.96 of theirs."""
    if answer.deviation is None:
        return np.full(3, np.nan), np.nan
    deviation, core = answer.deviation(points), answer.core
    held = float(np.mean(np.abs(distance) <= SURE * deviation))
    known = [_rms(deviation), core * answer.normal_std, 0.5 * core**2 * answer.curvature_std]
    return np.array(known), held


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
