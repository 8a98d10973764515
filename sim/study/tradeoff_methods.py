"""The methods that are compared on one patch: ours, the paper's, peers'."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from touchatlas.patch import FitOptions, Patch, Penalty, fit_paper, fit_patch
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.patch.geometry.polynomial import LocalPolynomial
from touchatlas.patch.paper.steepest_descent import sign_frozen_descent
from touchatlas.patch.paper.total_curvature import fold_problem
from touchatlas.sim.study.peers import Jet, fit_jet, mesh_around, mesh_curvatures
from touchatlas.sim.study.scenes import Scene

# The paper's multiplier of (5), length^2, in millimetres as its objects are.
PAPER_MULTIPLIER = 0.3
# The paper's (5) by the paper's own solver, see METHODS.
PAPER = "steepest_descent"
# How near to zero, in radii, a height is sought, and in how many steps.
_FOUND, _SECANT_STEPS = 1e-12, 20
# Farther off, in radii, none is sought.
_FAR = 1e3


@dataclass(frozen=True)
class Method:
    """One way from touches to a surface.

    Parameters
    ----------
    fit : callable
        What is timed.
    judge : callable
        (answer, scene) to the measures by name.
    prepare : callable
        (scene, generator) to the argument of ``fit``.
    count : int
        Fits that one call makes.
    """

    fit: Callable[[Any], Any]
    judge: Callable[[Any, Scene], dict[str, float]]
    prepare: Callable[[Scene, np.random.Generator], Any] = lambda scene, rng: scene
    count: int = 1


def height_error(patch: Patch, points) -> np.ndarray:
    """(n,) heights of world points over a patch along its normal, length.

    The height z(x, y) is where the signed distance along the normal through each point vanishes,
    found by secants; infinite where they do not meet the patch.
    """
    far, before = _FAR * patch.radius, np.zeros(len(points))
    height = -patch.signed_distance(points)
    value = -height
    for _ in range(_SECANT_STEPS):
        ahead = patch.signed_distance(points + height[:, None] * patch.frame.normal)
        slope = ahead - value
        # Where it is found already, what is left of the slope is rounding.
        going = (np.abs(ahead) > _FOUND * patch.radius) & (slope != 0.0)
        step = (height - before) / np.where(going, slope, 1.0)
        before, value = height, ahead
        height = np.clip(np.where(going, height - ahead * step, height), -far, far)
    return np.where(np.abs(value) <= 1e3 * _FOUND * patch.radius, -height, np.inf)


def judge_patch(patch: Patch, scene: Scene) -> dict[str, float]:
    """All measures of a patch but its time."""
    exact, known = np.array([scene.k1, scene.k2]), patch.curvatures
    error = np.array([known.k1, known.k2]) - exact
    distance = np.abs(patch.signed_distance(scene.verifying))
    return {
        **_height_measures(height_error(patch, scene.verifying)),
        **_curvature_measure(error, scene),
        "within": float(np.mean(distance <= SURE * patch.deviation(scene.verifying))),
        "curvature_within": float(np.mean(np.abs(error) <= SURE * known.std)),
    }


def _judge_jet(jet: Jet, scene: Scene) -> dict[str, float]:
    error = np.array([jet.k1 - scene.k1, jet.k2 - scene.k2])
    heights = jet.height_error(scene.verifying)
    return {**_height_measures(heights), **_curvature_measure(error, scene)}


def _judge_mesh(curvatures, scene: Scene) -> dict[str, float]:
    return _curvature_measure(curvatures[0] - np.array([scene.k1, scene.k2]), scene)


def _height_measures(error) -> dict[str, float]:
    size = np.abs(error)
    return {"mean_error": float(size.mean()), "max_error": float(size.max())}


def _curvature_measure(error, scene: Scene) -> dict[str, float]:
    size = max(abs(scene.k1), abs(scene.k2), 1.0 / scene.reach)
    return {"curvature_error": float(np.sqrt(np.mean(error**2)) / size)}


def _ours(options: FitOptions) -> Method:
    return Method(
        lambda scene: fit_patch(scene.contact, scene.contours, scene.normal, options=options).patch,
        judge_patch,
    )


def _paper(penalty: Penalty) -> Method:
    return Method(
        lambda scene: fit_paper(
            scene.contact, scene.contours, scene.normal, penalty, PAPER_MULTIPLIER
        ),
        judge_patch,
    )


def _by_descent(scene: Scene) -> Patch:
    """The paper's (5) by the paper's own solver."""
    patch = fit_paper(scene.contact, scene.contours, scene.normal, Penalty.NONE)
    local = patch.frame.to_local(np.concatenate([c.points for c in scene.contours]))
    known = patch.curvatures
    problem = fold_problem(local, known.k1, known.k2, PAPER_MULTIPLIER)
    found = problem.scaled_polynomial(sign_frozen_descent(problem).coefficients)
    return replace(patch, polynomial=LocalPolynomial(patch.polynomial.basis, found, problem.radius))


def _jet(degree: int) -> Method:
    def fit(scene: Scene) -> Jet:
        samples = np.concatenate([contour.points for contour in scene.contours])
        return fit_jet(scene.contact, samples, scene.normal, degree)

    return Method(fit, _judge_jet)


METHODS = {
    "map": _ours(FitOptions()),
    "monge": _ours(FitOptions(height_only=True, adaptive=False)),
    "least_squares": _paper(Penalty.NONE),
    "total_curvature": _paper(Penalty.TOTAL_CURVATURE),
    PAPER: Method(_by_descent, judge_patch),
    "excess_curvature": _paper(Penalty.EXCESS_CURVATURE),
    "jet_2": _jet(2),
    "jet_4": _jet(4),
    # Of 271 samples instead of 57. One call fits a quadric at each of them: the time is of one.
    "igl_mesh": Method(lambda mesh: mesh_curvatures(*mesh), _judge_mesh, mesh_around, 271),
}
