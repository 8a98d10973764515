"""Fits of surfaces of revolution in closed form, cone and torus, by least squares of distances
from starts about the axis that normals of a quadric or quartic meet.

Their coefficients are a point of the axis (3), the axis, a unit vector (3), and sizes, of which the
last one is negative where the outside of the body lies within.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from scipy.optimize import leastsq

from touchatlas.atlas.pieces.kinds import Kind, value_gradient_terms
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross, evenly
from touchatlas.patch.geometry.frame import any_tangent

# Largest size over that of the piece: samples show no less bend.
_LARGEST = 50.0
# Samples of which starts are made, and those by which one is refined.
_MANY, _FEW = 400, 100
# Root mean square of the distances, in deviations, beyond which samples are of no such surface.
_ASTRAY = 4.0
# Evaluations of each start, and of the best of them: one that converges takes 5 to 20.
_FIRST, _EVALUATIONS = 8, 30

# Parts of the samples, those nearest to the middle, whose normals give a start: a quartic does not
# follow a whole tube, and those of a small part tell the axis badly.
_PARTS = 1.0, 0.5, 0.25

# From points (n, 3), normals (n, 3) and noise (n,), scaled, to coefficients.
Starts = Callable[[np.ndarray, np.ndarray, np.ndarray], Iterator[np.ndarray]]


def fit_cone(points, normals, std) -> Piece | None:
    """The cone that fits samples (n, 3) best; None where none follows them, or where its apex or
    bend is beyond what they show."""
    return _fitted(Kind.CONE, points, normals, std, _cones, _is_cone)


def fit_torus(points, normals, std) -> Piece | None:
    """The torus that fits samples (n, 3) best; None where none follows them."""
    return _fitted(Kind.TORUS, points, normals, std, _tori, _is_ring)


def _fitted(
    kind: Kind, points, normals, std, starts: Starts, is_sound: Callable[[np.ndarray], bool]
) -> Piece | None:
    """The piece of a kind that fits samples (n, 3) best, the best of the sound local minima to
    which starts lead; None where none follows them."""
    origin, axes, scale = frame_of(points, normals)
    local, noise = (points - origin) @ (axes.T / scale), np.broadcast_to(std / scale, len(points))
    facing = normals @ axes.T
    many, few = (evenly(np.arange(len(points)), most) for most in (_MANY, _FEW))
    best, least = None, np.inf
    for start in starts(local[many], facing[many], noise[many]):
        cost, found = _refined(kind, start, local[few], noise[few], _FIRST)
        if cost < least and is_sound(found):
            best, least = found, cost
        # As close as noise lets samples be.
        if 2.0 * least < len(few):
            break
    if best is None:
        return None
    cost, found = _refined(kind, best, local[few], noise[few], _EVALUATIONS)
    if 2.0 * cost > _ASTRAY**2 * len(few):
        return None
    _, found = _refined(kind, found, local, noise, _EVALUATIONS)
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


def _refined(kind: Kind, start, points, noise, evaluations: int) -> tuple[float, np.ndarray]:
    """Half the sum of squared distances of points (n, 3) from the nearest surface of a kind, in
    deviations, and its coefficients: Levenberg-Marquardt steps, the axis kept a unit vector, with
    so many evaluations at most."""
    basis = _basis(start)

    def moved(change) -> np.ndarray:
        new = start + basis @ change
        new[3:6] /= np.sqrt(new[3:6] @ new[3:6])
        return new

    # The last one is asked for distances, then for slopes.
    @lru_cache(maxsize=1)
    def after(change: bytes):
        new = moved(np.frombuffer(change))
        return new, *value_gradient_terms(kind, new, points)

    def slopes(change) -> np.ndarray:
        new, _, _, terms = after(change.tobytes())
        rows = terms.copy()
        # That by the axis holds across it, as the axis is made a unit vector.
        rows[3:6] -= np.outer(new[3:6], new[3:6] @ rows[3:6])
        return (rows.T @ basis) / noise[:, None]

    # The steps are those of ``least_squares``, which takes a third longer.
    found, _, more, _, _ = leastsq(
        lambda change: after(change.tobytes())[1] / noise,
        np.zeros(basis.shape[1]),
        Dfun=slopes,
        full_output=True,
        ftol=1e-8,
        xtol=1e-8,
        gtol=1e-8,
        maxfev=evaluations,
    )
    return 0.5 * float(more["fvec"] @ more["fvec"]), moved(found)


def _revolution_axes(points, normals) -> Iterator[tuple[np.ndarray, np.ndarray]]:
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


def _meridian(points, axis, point) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) of points (n, 3) from an axis through a point, and heights (n,) along it."""
    offset = points - point
    height = offset @ axis
    return np.sqrt(np.maximum((offset * offset).sum(axis=1) - height**2, 0.0)), height


def _basis(coefficients) -> np.ndarray:
    """(t, t - 1) changes of the coefficients (t,) whose axis stays a unit vector."""
    count, axis = len(coefficients), coefficients[3:6]
    basis = np.zeros((count, count - 1))
    basis[[0, 1, 2], [0, 1, 2]] = 1.0
    u = any_tangent(axis)
    basis[3:6, 3], basis[3:6, 4] = u, cross(axis, u)
    basis[np.arange(6, count), np.arange(5, count - 1)] = 1.0
    return basis


def _is_cone(cone) -> bool:
    """Whether samples show the bend of a cone, and that it narrows."""
    sine, cosine = np.sin(np.abs(cone[6])), np.cos(cone[6])
    near = np.linalg.norm(cone[:3]) < _LARGEST
    return bool(near and sine * _LARGEST > 1.0 and cosine * _LARGEST > 1.0)


def _cones(points, normals, noise) -> Iterator[np.ndarray]:
    """Cones (7,) about the axes that normals of a quadric through points (n, 3) meet: the line of
    their distances from an axis over their heights along it."""
    frame = frame_of(points, normals)
    quadric = linear_fit(Kind.QUADRIC, points, *frame, noise)
    for axis, point in _revolution_axes(points, quadric.at(points)[1]):
        rho, height = _meridian(points, axis, point)
        columns = np.stack([height, np.ones(len(height))], axis=1)
        slope, level = np.linalg.lstsq(columns, rho, rcond=None)[0]
        if abs(slope) * _LARGEST > 1.0:
            apex = point - level / slope * axis
            yield np.concatenate([apex, np.sign(slope) * axis, [np.arctan(abs(slope))]])


def _is_ring(torus) -> bool:
    """Whether the tube leaves a hole, and samples show the bend of both radii."""
    return bool(abs(torus[7]) < torus[6] < _LARGEST and abs(torus[7]) * _LARGEST > 1.0)


def _tori(points, normals, noise) -> Iterator[np.ndarray]:
    """Tori (8,) about the axes that normals of quartics through parts of points (n, 3) meet."""
    order = np.argsort((points * points).sum(axis=1), kind="stable")
    for part in _PARTS:
        count = int(part * len(points))
        if count < Kind.QUARTIC.parameters:
            break
        some = np.sort(order[:count])
        frame = frame_of(points[some], normals[some])
        quartic = linear_fit(Kind.QUARTIC, points[some], *frame, noise[some])
        for axis, point in _revolution_axes(points[some], quartic.at(points[some])[1]):
            yield _about(points[some], axis, point)


def _about(points, axis, point) -> np.ndarray:
    """The torus (8,) about an axis whose section fits points (n, 3) best: the circle (Kasa 1976)
    of their distances from the axis and heights along it."""
    rho, height = _meridian(points, axis, point)
    columns = np.stack([rho, height, np.ones(len(rho))], axis=1)
    a, b, c = np.linalg.lstsq(columns, rho**2 + height**2, rcond=None)[0]
    ring, level = 0.5 * a, 0.5 * b
    tube = np.sqrt(max(c + ring**2 + level**2, 0.0))
    return np.concatenate([point + level * axis, axis, [ring, tube]])
