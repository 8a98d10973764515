"""Fits of surfaces of revolution in closed form, cone and torus, by least squares of distances
from starts about the axis that normals meet.

Their coefficients are a point of the axis (3), the axis, a unit vector (3), and sizes, of which the
last one is negative where the outside of the body lies within.
"""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.optimize import least_squares

from touchatlas.atlas.pieces.kinds import Kind, value_gradient_terms
from touchatlas.atlas.pieces.linear_fit import frame_of
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Largest size over that of the piece: samples show no less bend.
LARGEST = 50.0
# Samples of which starts are made, and those by which one is refined.
_MANY, _FEW = 400, 100
# Root mean square of the distances, in deviations, beyond which samples are of no such surface.
_ASTRAY = 4.0
# Evaluations of each start, and of the best of them: one that converges takes 5 to 20.
_FIRST, _EVALUATIONS = 8, 30

# From points (n, 3), normals (n, 3) and noise (n,), scaled, to coefficients.
Starts = Callable[[np.ndarray, np.ndarray, np.ndarray], Iterator[np.ndarray]]


def fit_about_axis(
    kind: Kind, points, normals, std, starts: Starts, is_sound: Callable[[np.ndarray], bool]
) -> Piece | None:
    """The piece of a kind that fits samples (n, 3) best, the best of the sound local minima to
    which starts lead; None where none follows them."""
    origin, axes, scale = frame_of(points, normals)
    local, noise = (points - origin) @ (axes.T / scale), np.broadcast_to(std / scale, len(points))
    facing = normals @ axes.T
    many, few = (_evenly(len(points), most) for most in (_MANY, _FEW))
    best, least = None, np.inf
    for start in starts(local[many], facing[many], noise[many]):
        cost, found = refined(kind, start, local[few], noise[few], _FIRST)
        if cost < least and is_sound(found):
            best, least = found, cost
        # As close as noise lets samples be.
        if 2.0 * least < len(few):
            break
    if best is None:
        return None
    cost, found = refined(kind, best, local[few], noise[few], _EVALUATIONS)
    if 2.0 * cost > _ASTRAY**2 * len(few):
        return None
    _, found = refined(kind, found, local, noise, _EVALUATIONS)
    if not is_sound(found):
        return None
    _, outward, terms = value_gradient_terms(kind, found, local)
    if (outward * facing).sum() < 0.0:
        found = np.append(found[:-1], -found[-1])
    basis = _basis(found)
    weighted = (basis.T @ terms) / noise
    gram = weighted @ weighted.T
    # What samples leave open has a large deviation, and no infinite one.
    covariance = np.linalg.inv(gram + 1e-9 * gram.trace() * np.eye(len(gram)))
    return Piece(kind, origin, axes, scale, found, basis @ covariance @ basis.T)


def refined(kind: Kind, start, points, noise, evaluations: int) -> tuple[float, np.ndarray]:
    """Half the sum of squared distances of points (n, 3) from the nearest surface of a kind, in
    deviations, and its coefficients: Levenberg-Marquardt steps, the axis kept a unit vector, with
    so many evaluations at most."""
    basis = _basis(start)

    def moved(change) -> np.ndarray:
        new = start + basis @ change
        new[3:6] /= np.sqrt(new[3:6] @ new[3:6])
        return new

    def slopes(change) -> np.ndarray:
        new = moved(change)
        rows = value_gradient_terms(kind, new, points)[2]
        # That by the axis holds across it, as the axis is made a unit vector.
        rows[3:6] -= np.outer(new[3:6], new[3:6] @ rows[3:6])
        return (rows.T @ basis) / noise[:, None]

    found = least_squares(
        lambda change: value_gradient_terms(kind, moved(change), points)[0] / noise,
        np.zeros(basis.shape[1]),
        slopes,
        method="lm",
        max_nfev=evaluations,
    )
    return float(found.cost), moved(found.x)


def revolution_axes(points, normals) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The two lines that normals (n, 3) at points (n, 3) meet best: unit directions (3,), and
    points (3,) on them. Those of a surface of revolution meet its axis (Pottmann and Randrup,
    Rotational and helical surface approximation for reverse engineering, 1998).

    A normal n at p meets the line with direction a and moment b where a.(p x n) + b.n = 0.
    """
    middle = points.mean(axis=0)
    moment = cross(points - middle, normals)
    inverse = np.linalg.pinv(normals.T @ normals, hermitian=True) @ (normals.T @ moment)
    rest = moment.T @ moment - (moment.T @ normals) @ inverse
    vectors = np.linalg.eigh(rest)[1].T
    for axis in vectors[:2]:
        yield axis, middle + cross(axis, -inverse @ axis)


def meridian(points, axis, point) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) of points (n, 3) from an axis through a point, and heights (n,) along it."""
    offset = points - point
    height = offset @ axis
    return np.sqrt(np.maximum((offset * offset).sum(axis=1) - height**2, 0.0)), height


def _evenly(count: int, most: int) -> np.ndarray:
    return np.linspace(0, count - 1, min(count, most)).astype(int)


def _basis(coefficients) -> np.ndarray:
    """(t, t - 1) changes of the coefficients (t,) whose axis stays a unit vector."""
    count, axis = len(coefficients), coefficients[3:6]
    basis = np.zeros((count, count - 1))
    basis[[0, 1, 2], [0, 1, 2]] = 1.0
    u = any_tangent(axis)
    basis[3:6, 3], basis[3:6, 4] = u, cross(axis, u)
    basis[np.arange(6, count), np.arange(5, count - 1)] = 1.0
    return basis
