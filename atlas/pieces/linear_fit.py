"""Linear fits: the polynomial of a kind that fits samples best in a frame, at feet."""

import numpy as np

from touchatlas.atlas.pieces.kinds import (
    CLOSED_FORMS,
    Kind,
    prior_precision,
    terms_at,
    value_and_gradient,
)
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal

# Fits at the feet of the fit before. They change it by less than its deviation after the second.
# Doubled, it takes twice the time.
_AT_FEET = 3
# Largest distance of a sample from its foot, in standard deviations. Doubled, feet are sought where
# the fit before does not hold.
_FARTHEST = 5.0
# Least length of the mean normal; below it the samples face all ways and one normal is taken.
# Doubled, half a ball has the normal of one sample.
_ONE_SIDED = 0.3
# Least gradient in a weight, no unit. Doubled, samples near a crossing weigh less.
_LEAST_GRADIENT = 0.2
# Monomials 1, x, y, and of second order, which begin the fit of a sextic. With those in z as well,
# which are hardly determined, twice as much of a blob is off.
_PARABOLOID = 6
_TINY = float(np.finfo(float).tiny)
# Coefficients of a sphere through the origin of its frame: 1, x, y, and the sum of the squares.
_SPHERE = np.zeros((9, 4))
_SPHERE[0, 0] = _SPHERE[1, 1] = _SPHERE[2, 2] = _SPHERE[3, 3] = _SPHERE[5, 3] = _SPHERE[8, 3] = 1.0
_PRECISIONS: dict[Kind, np.ndarray] = {
    kind: np.diag(prior_precision(kind)) for kind in Kind if kind not in CLOSED_FORMS
}
_PRECISIONS[Kind.SPHERE] = (_SPHERE.T * prior_precision(Kind.SPHERE)) @ _SPHERE


def frame_of(points, normals) -> tuple[np.ndarray, np.ndarray, float]:
    """Origin, axes and scale for samples. They move, turn and scale as the samples do."""
    offset = points - points.sum(axis=0) / len(points)
    nearest = np.einsum("ij,ij->i", offset, offset).argmin()
    origin = points[nearest]
    normal = normals.sum(axis=0) / len(normals)
    length = np.sqrt(normal @ normal)
    normal = normal / length if length > _ONE_SIDED else normals[nearest]
    offset = points - origin
    square = (offset * offset).sum(axis=1)
    tangent = offset[square.argmax()]
    across = tangent - (tangent @ normal) * normal
    if not across @ across > 1e-6 * square.max():
        tangent = any_tangent(normal)
    scale = float(np.sqrt(max(square.max(), _TINY)))
    return origin, axes_from_normal(normal, tangent), scale


def linear_fit(kind: Kind, points, origin, axes, scale: float, std) -> Piece:
    """The piece in a frame by linear least squares with a prior, first of distances along z."""
    scaled = (points - origin) @ (axes.T / scale)
    noise = std / scale
    now = kind if kind.lawful else Kind.QUADRIC
    terms = terms_at(now, scaled)
    start = terms[:_PARABOLOID] if kind is Kind.SEXTIC else terms
    solution = _solve(now, start, scaled[:, 2], 1.0 / noise**2)
    if kind is Kind.PLANE:
        # The gradient is the same everywhere.
        steep = np.sqrt(solution[0][1] ** 2 + solution[0][2] ** 2 + 1.0)
        return Piece(kind, origin, axes, scale, solution[0], solution[1] * steep**2)
    for _ in range(_AT_FEET):
        value, gradient = value_and_gradient(now, solution[0], scaled, terms)
        steep = np.maximum(np.sqrt((gradient * gradient).sum(axis=1)), _LEAST_GRADIENT)
        distance = np.clip(value / steep, -_FARTHEST * noise, _FARTHEST * noise)
        at = scaled - (distance / steep)[:, None] * gradient
        heights, weight = at[:, 2] + steep * distance, steep**-2.0 / noise**2
        solution = _solve(kind, terms_at(kind, at), heights, weight)
        if now is not kind:
            now, terms = kind, terms_at(kind, scaled)
    return Piece(kind, origin, axes, scale, *solution)


def _solve(kind: Kind, terms, heights, weight) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and covariance of the φ that has given heights (n,) where its monomials are
    terms (s, n)."""
    reduced = terms[: kind.terms]
    if kind is Kind.SPHERE:
        reduced = _SPHERE.T @ reduced
    weighted = reduced * weight
    size = len(reduced)
    inverse = np.linalg.inv(weighted @ reduced.T + _PRECISIONS[kind][:size, :size])
    mean = inverse @ (weighted @ heights)
    if kind is Kind.SPHERE:
        return _SPHERE @ mean, _SPHERE @ inverse @ _SPHERE.T
    # np.pad takes about as long as the inverse.
    return np.append(mean, np.zeros(kind.terms - size)), inverse
