"""fit_paper: a patch as the paper fits it, its section 2 from end to end."""

from collections.abc import Callable
from enum import Enum

import numpy as np

from touchatlas.patch.fit.fit_patch import FitOptions
from touchatlas.patch.fit.smoothness import scaled_noise
from touchatlas.patch.geometry.arrays import frozen_array
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.curvature import (
    curvatures_from_sections,
    normal_curvature,
    normal_from_tangents,
)
from touchatlas.patch.geometry.frame import DarbouxFrame, any_tangent, axes_from_normal
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import LocalPolynomial, monge_basis
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.patch.paper.newton import newton_minimum
from touchatlas.patch.paper.steepest_descent import Descent
from touchatlas.patch.paper.total_curvature import (
    FoldProblem,
    fold_problem,
    least_squares_coefficients,
    scale_free_multiplier,
    squared_error,
)

# The paper's 0.3 mm^2, for a patch of radius 20 mm.
MULTIPLIER_SHARE = 7.5e-4
# Candidates for lam over the squared patch radius.
_SHARES = np.geomspace(1e-1, 1e-6, 12).tolist()
_DISCREPANCY = 1.5
_WORST_CONDITION = 1e3
_LOOSE_STD = 1.0
_LEAST_SHARE = 1e-4
# As in ``start``: rounding would choose the outer side.
_TANGENT = 1e-9
_CONSTANT, _SLOPES, _SQUARES = 0, slice(1, 3), [3, 5]


class Penalty(Enum):
    """What is added to the squared error of the heights."""

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
    """Patch around a reference point by the paper's steps.

    Sections give tangents and curvatures, these the normal, the principal curvatures and the
    Darboux frame; k1 and k2 stay fixed as in equation (1), and the coefficients of order 3 and 4
    are fitted over that frame.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point; the patch passes through it.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    penalty : Penalty
    multiplier : float, length^2, optional
        lam of (5); None for MULTIPLIER_SHARE of the squared patch radius. See also
        ``multiplier_from_data``.
    solver : callable
        Of (5); ``sign_frozen_descent`` is the paper's own.

    Returns
    -------
    Patch
        Its covariance is of the data alone: a penalty is a choice, not knowledge. Slopes and
        curvatures are uncertain as the sections are. What no curve sees is given a standard
        deviation of one patch radius.

    Raises
    ------
    ValueError
        Contours too short, too few, or in fewer than three directions.

    Notes
    -----
    The paper, sections 2.1 and 2.2. At an umbilic k1 = k2, their mean: directions are free
    there, and unequal values along free directions would be wrong.
    """
    point, noise = frozen_array(point, (3,), "reference point"), _noise(contours)
    axes, k1, k2, condition, section_covariance = _darboux(point, contours, outward, noise)
    frame = DarbouxFrame(point, axes)
    local = frame.to_local(np.concatenate([c.points for c in contours]))
    if multiplier is None:
        multiplier = scale_free_multiplier(MULTIPLIER_SHARE, local)
    reference = k1 * k2 if penalty is Penalty.EXCESS_CURVATURE else 0.0
    problem = fold_problem(local, k1, k2, multiplier, reference_curvature=reference)
    if penalty is Penalty.NONE:
        free = least_squares_coefficients(problem)
    else:
        free = solver(problem).coefficients
    radius, basis = problem.radius, monge_basis(problem.degree)
    freedom = max(len(local) - problem.size, 1)
    residual = float(np.sqrt(squared_error(problem, free) / freedom))
    return Patch(
        -1,
        frame,
        LocalPolynomial(basis, problem.scaled_polynomial(free), radius),
        _covariance(problem, section_covariance, scaled_noise(max(noise, residual), radius)),
        radius,
        FitOptions().core,
        noise,
        residual,
        len(local),
        condition,
    )


def multiplier_from_data(point, contours: tuple[Contour, ...], outward, penalty: Penalty) -> float:
    """lam of (5) as large as the data bear, length^2.

    The largest of twelve values from 1e-6 to 1e-1 of the squared patch radius with which (5)
    leaves no more than 1.5 times the squared error that plain least squares leaves.

    Parameters
    ----------
    point, contours, outward, penalty
        As for ``fit_paper``, whose ``multiplier`` this is.

    Raises
    ------
    ValueError
        As ``fit_paper`` does.

    Notes
    -----
    Morozov's discrepancy principle, with the error of (3) for the noise.
    """
    point, noise = frozen_array(point, (3,), "reference point"), _noise(contours)
    axes, k1, k2, *_ = _darboux(point, contours, outward, noise)
    local = DarbouxFrame(point, axes).to_local(np.concatenate([c.points for c in contours]))
    reference = k1 * k2 if penalty is Penalty.EXCESS_CURVATURE else 0.0
    for share in _SHARES:
        multiplier = scale_free_multiplier(share, local)
        problem = fold_problem(local, k1, k2, multiplier, reference_curvature=reference)
        borne = _DISCREPANCY * squared_error(problem, least_squares_coefficients(problem))
        if squared_error(problem, newton_minimum(problem).coefficients) <= borne:
            break
    return multiplier


def _noise(contours) -> float:
    """Root mean square of the noise of contours, which must be three or more."""
    if len(contours) < 3:
        raise ValueError(
            f"{len(contours)} sections were given; principal curvatures need 3 or more"
        )
    return float(np.sqrt(np.mean([c.noise_std**2 for c in contours])))


def _darboux(point, contours, outward, noise):
    """Axes (3, 3), k1, k2 and the condition from the sections; the covariances (2, 2) of the
    slopes and of k1 and k2 in those axes."""
    sections = fit_sections(point, contours, noise)
    tangents = np.array([s.tangent for s in sections])
    outward = frozen_array(outward, (3,), "outward")
    normal = normal_from_tangents(tangents, outward)
    if abs(normal @ outward) <= _TANGENT * np.abs(outward).max():
        raise ValueError(
            "outward is zero or tangent to the surface and tells no side; give one that points out"
        )
    axes = axes_from_normal(normal, any_tangent(normal))
    angles = np.arctan2(tangents @ axes[1], tangents @ axes[0])
    curvatures = normal_curvature(np.array([s.curvature_vector for s in sections]), normal)
    stds = np.array([s.curvature_std for s in sections])
    k1, k2, angle, std, umbilic, condition = curvatures_from_sections(curvatures, angles, stds)
    if condition > _WORST_CONDITION:
        raise ValueError(
            f"the sections have fewer than three distinct directions (condition {condition:.3g}); "
            "choose sampling planes about 60 degrees apart"
        )
    if umbilic:
        k1 = k2 = 0.5 * (k1 + k2)
    axes = axes_from_normal(normal, np.cos(angle) * axes[0] + np.sin(angle) * axes[1])
    across = tangents @ axes[:2].T
    stds = np.array([s.tangent_std for s in sections])
    # An exact section among noisy ones would leave the system singular to rounding.
    weight = np.maximum(stds, max(_LEAST_SHARE * stds.max(), np.finfo(float).eps)) ** -2.0
    slopes = np.linalg.inv((across * weight[:, None]).T @ across)
    return axes, k1, k2, condition, (slopes, np.diag(std**2))


def _covariance(problem: FoldProblem, section_covariance, noise) -> np.ndarray:
    """(t, t) covariance of the scaled coefficients; the three groups are fitted apart."""
    slopes, curvatures = section_covariance
    orders = monge_basis(problem.degree).orders
    free = np.flatnonzero(orders >= 3)
    out = np.zeros((len(orders), len(orders)))
    out[_CONSTANT, _CONSTANT] = noise**2
    out[_SLOPES, _SLOPES] = slopes
    out[np.ix_(_SQUARES, _SQUARES)] = curvatures * (0.5 * problem.radius) ** 2
    values, vectors = np.linalg.eigh(problem.design.T @ problem.design)
    precision = np.maximum(values, 0.0) / noise**2 + _LOOSE_STD**-2.0
    out[np.ix_(free, free)] = (vectors / precision) @ vectors.T
    # Rounding leaves the inverse of a symmetric matrix a little askew.
    return 0.5 * (out + out.T)
