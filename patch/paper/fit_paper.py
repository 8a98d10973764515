"""fit_paper: the patch of the paper's section 2."""

from collections.abc import Callable
from enum import Enum

import numpy as np

from touchatlas.patch.checks import check_type
from touchatlas.patch.fit.fit_patch import FitOptions
from touchatlas.patch.fit.smoothness import scaled_noise
from touchatlas.patch.geometry.arrays import frozen_array
from touchatlas.patch.geometry.contour import Contour, check_contours
from touchatlas.patch.geometry.curvature import (
    LEAST_ANGLE,
    WORST_CONDITION,
    curvatures_from_sections,
    normal_curvature,
    normal_from_tangents,
)
from touchatlas.patch.geometry.frame import DarbouxFrame, any_tangent, axes_from_normal
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import LocalPolynomial, monge_basis
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.patch.paper.curvature_on_grid import DEGREE
from touchatlas.patch.paper.newton import newton_minimum
from touchatlas.patch.paper.steepest_descent import Descent
from touchatlas.patch.paper.total_curvature import (
    FoldProblem,
    fold_problem,
    least_squares_coefficients,
    scale_free_multiplier,
    squared_error,
)

# Default lam over the squared patch radius: the paper's 0.3 mm^2 at a radius of 20 mm.
MULTIPLIER_FRACTION = 7.5e-4


class Penalty(Enum):
    """The term that is added to the squared error of the heights."""

    NONE = "nothing: the paper's (3)"
    TOTAL_CURVATURE = "total absolute Gaussian curvature: the paper's (5)"
    EXCESS_CURVATURE = "total |K - k1 k2|, which does not flatten"


def fit_paper(
    point,
    contours: tuple[Contour, ...],
    outward,
    penalty: Penalty,
    multiplier: float | None = None,
    solver: Callable[[FoldProblem], Descent] = newton_minimum,
) -> Patch:
    """Patch around a reference point by the steps of the paper.

    Sections give tangents and curvatures. These give the normal, the principal curvatures and the
    Darboux frame. k1 and k2 then stay fixed, as in equation (1), and the coefficients of order 3
    and 4 are fitted in that frame.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point. The patch passes through it.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    penalty : Penalty
    multiplier : float, length^2, optional
        lam of (5). None stands for MULTIPLIER_FRACTION times the squared patch radius.
    solver : callable
        Solver of (5). The paper's own is ``sign_frozen_descent``.

    Returns
    -------
    Patch
        Its covariance is of the data alone, because a penalty is a choice and not knowledge.
        Slopes and curvatures have the deviations of the sections. Coefficients that no curve
        determines have a standard deviation of one patch radius.

    Raises
    ------
    ValueError
        Contours too short, too few, or in fewer than three directions.

    Notes
    -----
    The paper, sections 2.1 and 2.2. At an umbilic both curvatures are set to their mean: the
    directions are arbitrary there, and unequal curvatures along them would be wrong.
    """
    check_contours(contours)
    check_type("penalty", penalty, Penalty)
    point, noise = frozen_array(point, (3,), "reference point"), _noise(contours)
    axes, k1, k2, condition, section_covariance = _darboux(point, contours, outward, noise)
    frame = DarbouxFrame(point, axes)
    local = frame.to_local(np.concatenate([c.points for c in contours]))
    if multiplier is None:
        multiplier = scale_free_multiplier(MULTIPLIER_FRACTION, local)
    reference = k1 * k2 if penalty is Penalty.EXCESS_CURVATURE else 0.0
    problem = fold_problem(local, k1, k2, multiplier, reference_curvature=reference)
    if penalty is Penalty.NONE:
        free = least_squares_coefficients(problem)
    else:
        free = solver(problem).coefficients
    radius = problem.radius
    residual = float(np.sqrt(squared_error(problem, free) / max(len(local) - problem.size, 1)))
    return Patch(
        -1,
        frame,
        LocalPolynomial(monge_basis(DEGREE), problem.scaled_polynomial(free), radius),
        _covariance(problem, section_covariance, scaled_noise(max(noise, residual), radius)),
        radius,
        FitOptions().core,
        noise,
        residual,
        len(local),
        condition,
    )


def _noise(contours) -> float:
    """Root mean square of the noise of contours. ValueError for fewer than three."""
    if len(contours) < 3:
        raise ValueError(
            f"{len(contours)} sections were given; principal curvatures need 3 or more"
        )
    return float(np.sqrt(np.mean([c.noise_std**2 for c in contours])))


def _darboux(point, contours, outward, noise):
    """Axes (3, 3), k1, k2, the condition of the sections, and a pair of covariances (2, 2).

    The covariances are those of the slopes and of k1, k2, in these axes.
    """
    sections = fit_sections(point, contours, noise)
    tangents = np.array([s.tangent for s in sections])
    outward = frozen_array(outward, (3,), "outward")
    normal = normal_from_tangents(tangents, outward)
    if abs(normal @ outward) <= LEAST_ANGLE * np.abs(outward).max():
        raise ValueError(
            "outward is zero or tangent to the surface and tells no side; give one that points out"
        )
    axes = axes_from_normal(normal, any_tangent(normal))
    angles = np.arctan2(tangents @ axes[1], tangents @ axes[0])
    curvatures = normal_curvature(np.array([s.curvature_vector for s in sections]), normal)
    stds = np.array([s.curvature_std for s in sections])
    k1, k2, angle, std, umbilic, condition = curvatures_from_sections(curvatures, angles, stds)
    if condition > WORST_CONDITION:
        raise ValueError(
            f"the sections have fewer than three distinct directions (condition {condition:.3g}); "
            "choose sampling planes about 60 degrees apart"
        )
    if umbilic:
        k1 = k2 = 0.5 * (k1 + k2)
    axes = axes_from_normal(normal, np.cos(angle) * axes[0] + np.sin(angle) * axes[1])
    return axes, k1, k2, condition, (_slope_covariance(sections, tangents, axes), np.diag(std**2))


def _slope_covariance(sections, tangents, axes) -> np.ndarray:
    """(2, 2) covariance of the slopes along e1 and e2, from the deviations of the tangents."""
    design = tangents @ axes[:2].T
    stds = np.array([s.tangent_std for s in sections])
    # An exact section among noisy ones would leave the system singular.
    weight = np.maximum(stds, max(1e-4 * stds.max(), np.finfo(float).eps)) ** -2.0
    return np.linalg.inv((design * weight[:, None]).T @ design)


def _covariance(problem: FoldProblem, section_covariance, noise) -> np.ndarray:
    """(t, t) covariance of the scaled coefficients.

    Slopes, curvatures and higher orders are estimated separately, so their blocks are independent.
    """
    slopes, curvatures = section_covariance
    orders = monge_basis(DEGREE).orders
    free = np.flatnonzero(orders >= 3)
    out = np.zeros((len(orders), len(orders)))
    out[0, 0] = noise**2
    out[1:3, 1:3] = slopes
    out[np.ix_([3, 5], [3, 5])] = curvatures * (0.5 * problem.radius) ** 2
    values, vectors = np.linalg.eigh(problem.design.T @ problem.design)
    precision = np.maximum(values, 0.0) / noise**2 + 1.0
    out[np.ix_(free, free)] = (vectors / precision) @ vectors.T
    # Rounding leaves the computed inverse slightly asymmetric.
    return 0.5 * (out + out.T)
