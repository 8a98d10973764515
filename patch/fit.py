"""fit_patch: from contours around a reference point to a patch, the steps in order."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.contour import Contour, ContourEnd
from touchatlas.patch.curvature import (
    curvatures_from_sections,
    normal_from_tangents,
    principal_directions,
)
from touchatlas.patch.frame import DarbouxFrame, any_tangent, axes_from_normal
from touchatlas.patch.patch import Patch
from touchatlas.patch.polynomial import (
    VALUE,
    XX,
    XY,
    YY,
    LocalPolynomial,
    X,
    Y,
    derivative_coefficients,
    monge_basis,
    monomials,
    shape_operator,
)
from touchatlas.patch.section import fit_sections
from touchatlas.patch.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    choose_turn,
    coefficient_precision,
    effective_parameters,
    posterior,
    residual_square,
    scaled_noise,
)

_RADIUS_LEVELS = np.array([1.0, 0.8, 0.64, 0.5, 0.4])
# Of the system for the principal curvatures: reached by sections within about 2 degrees.
_WORST_CONDITION = 1e3
# Beyond these the surface was seen to stop or to break: the patch need not end before them.
_HARD_ENDS = (ContourEnd.EDGE, ContourEnd.LOST_CONTACT, ContourEnd.UNREACHABLE)


@dataclass(frozen=True)
class FitOptions:
    """How a patch is fitted.

    Parameters
    ----------
    degree : int
        Of the polynomial.
    core : float
        Share of its radius to which a patch claims to cover: its outline.
    """

    degree: int = 4
    core: float = 0.75


@dataclass(frozen=True, eq=False)
class PatchFit:
    """A patch, and what is needed to go on learning it.

    Parameters
    ----------
    patch : Patch
    equations : NormalEquations
        In coordinates scaled by the patch radius.
    turn : float
        Patch radius over feature length.
    """

    patch: Patch
    equations: NormalEquations
    turn: float


def fit_patch(
    point,
    contours: tuple[Contour, ...],
    outward,
    shared: np.ndarray | None = None,
    bias: float = np.inf,
    radius_limit: float = np.inf,
    radius_floor: float = 0.0,
    prior: SmoothnessPrior = SmoothnessPrior(),
    options: FitOptions = FitOptions(),
) -> PatchFit:
    """Patch around a reference point from the contours tracked through it.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point, on or near every contour.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    shared : (n, 3) float, length, world, optional
        Further samples of the same sheet, of earlier contours.
    bias : float, length
        Residuals beyond the noise that are borne before the radius is reduced.
    radius_limit : float, length
        The patch is made no larger than this.
    radius_floor : float, length
        Contours that end nearer than this, or residuals, make the patch no smaller.
    prior : SmoothnessPrior
    options : FitOptions

    Returns
    -------
    PatchFit

    Raises
    ------
    ValueError
        Contours too short, too few, or in fewer than three directions.

    Notes
    -----
    The paper, section 2, up to its equation (1); then a maximum-a-posteriori polynomial of
    all orders in place of equation (5), in the frame that the polynomial itself defines.
    """
    point = np.asarray(point, dtype=float)
    noise = float(np.sqrt(np.mean([c.noise_std**2 for c in contours])))
    axes, condition = frame_from_sections(point, contours, outward, noise)
    samples = np.concatenate([c.points for c in contours])
    if shared is not None and len(shared):
        samples = np.concatenate([samples, shared])
    reach = min(max(contour_extent(point, contours), radius_floor), radius_limit)
    basis = monge_basis(options.degree)

    local = (samples - point) @ axes.T
    share, turn, mean = _first_polynomial(
        basis, local / reach, noise / reach, bias / reach, prior, reach, radius_floor / reach
    )
    origin, axes = _reframe(basis, mean, reach, point, axes)
    radius = share * reach
    scaled = (samples - origin) @ axes.T / radius
    equations = accumulate(basis, scaled[(scaled[:, :2] ** 2).sum(axis=1) <= 1.0])
    return _finish(basis, equations, origin, axes, radius, noise, turn * share, condition, options)


def frame_from_sections(point, contours, outward, noise):
    """Axes (3, 3) from the sections alone, the paper's section 2.1, and the condition."""
    sections = fit_sections(point, contours, noise)
    tangents = np.array([s.tangent for s in sections])
    normal = normal_from_tangents(tangents, outward)
    axes = axes_from_normal(normal, any_tangent(normal))
    angles = np.arctan2(tangents @ axes[1], tangents @ axes[0])
    curvatures = np.array([s.curvature_vector for s in sections]) @ normal
    stds = np.array([s.curvature_std for s in sections])
    _, _, angle, _, _, condition = curvatures_from_sections(curvatures, angles, stds)
    if condition > _WORST_CONDITION:
        raise ValueError(
            f"the sections have fewer than three distinct directions (condition {condition:.3g}); "
            "choose sampling planes about 60 degrees apart"
        )
    e1 = np.cos(angle) * axes[0] + np.sin(angle) * axes[1]
    return axes_from_normal(normal, e1), condition


def contour_extent(point, contours) -> float:
    """Distance from the point to the nearest soft end of a contour: how far around is known.

    Hard ends (an edge, lost contact) do not count, unless there are no others.
    """
    soft: list[float] = []
    hard: list[float] = []
    for contour in contours:
        for place, end in zip((0, -1), contour.ends, strict=True):
            offset = contour.points[place] - point
            (hard if end in _HARD_ENDS else soft).append(offset @ offset)
    return float(np.sqrt(min(soft or hard)))


def accumulate(basis, scaled) -> NormalEquations:
    """Normal equations of samples (n, 3) in scaled local coordinates."""
    z = scaled[:, 2]
    terms = monomials(basis, scaled[:, 0], scaled[:, 1])
    return NormalEquations(terms @ terms.T, terms @ z, float(z @ z), len(z))


def _first_polynomial(basis, scaled, noise, bias, prior, reach, floor):
    """Share of the reach that the polynomial holds for, R / feature length, coefficients."""
    noise = float(scaled_noise(noise, 1.0))
    z = scaled[:, 2]
    terms = monomials(basis, scaled[:, 0], scaled[:, 1])
    distance = (scaled[:, :2] ** 2).sum(axis=1)
    levels = _RADIUS_LEVELS[max(0, int((floor <= _RADIUS_LEVELS).sum()) - 1) :: -1][::-1]
    mask = (distance <= (levels**2)[:, None]).astype(float)
    masked = mask[:, None, :] * terms
    gram, right = masked @ terms.T, masked @ z
    square, count = mask @ (z * z), mask.sum(axis=1)

    whole = NormalEquations(gram[0], right[0], float(square[0]), int(count[0]))
    turn = choose_turn(whole, basis.orders, noise, prior, reach)
    precision = coefficient_precision(basis.orders, turn)
    mean, covariance = posterior(gram, right, np.full(len(mask), noise), precision)
    used = effective_parameters(covariance, np.broadcast_to(precision, mean.shape))
    freedom = np.maximum(count - used, 1.0)
    variance = residual_square(gram, right, square, mean) / freedom
    limit = noise**2 * (1.0 + 2.0 * np.sqrt(2.0 / freedom)) + bias**2
    holds = variance <= limit
    holds[-1] = True
    level = int(holds.argmax())
    return float(levels[level]), turn, mean[level]


def _reframe(basis, mean, scale, point, axes):
    """Origin on the polynomial above the old one, and the Darboux axes there."""
    value, fx, fy, fxx, fxy, fyy = derivative_coefficients(basis, mean, [VALUE, X, Y, XX, XY, YY])[
        :, 0
    ]
    normal = np.array([-fx, -fy, 1.0]) @ axes
    normal /= np.sqrt(normal @ normal)
    shape = shape_operator(fx, fy, fxx, fxy, fyy)
    _, _, angle = principal_directions(shape)
    e1 = np.cos(angle) * axes[0] + np.sin(angle) * axes[1]
    return point + scale * value * axes[2], axes_from_normal(normal, e1)


def _finish(basis, equations, origin, axes, radius, noise, turn, condition, options) -> PatchFit:
    """The patch in its final frame."""
    precision = coefficient_precision(basis.orders, turn)
    mean, covariance = posterior(
        equations.gram, equations.right, scaled_noise(noise, radius), precision
    )
    freedom = max(equations.count - effective_parameters(covariance, precision), 1.0)
    residual = np.sqrt(
        residual_square(equations.gram, equations.right, equations.square, mean) / freedom
    )
    patch = Patch(
        -1,
        DarbouxFrame(origin, axes),
        LocalPolynomial(basis, mean, radius),
        covariance * max(1.0, (residual / scaled_noise(noise, radius)) ** 2),
        radius,
        options.core,
        noise,
        float(residual * radius),
        equations.count,
        condition,
    )
    return PatchFit(patch, equations, turn)
