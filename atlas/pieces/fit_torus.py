"""Fit a torus to samples: least squares of distances, started from the axis that normals meet."""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares

from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.pieces.torus import value_gradient_terms
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Parts of the samples, those nearest to the middle, whose normals give a start: a quartic does not
# follow a whole tube, and those of a small part tell the axis badly.
_PARTS = 1.0, 0.5, 0.25
# Largest radius of the circle and the tube over the size of the piece: samples show no less bend.
_LARGEST = 50.0
# Samples of which starts are made, and those by which one is refined.
_MANY, _FEW = 400, 100
# Root mean square of the distances, in deviations, beyond which samples are of no torus.
_ASTRAY = 4.0
# Evaluations of each start, and of the best of them: one that converges takes 5 to 20.
_FIRST, _EVALUATIONS = 8, 30


def fit_torus(points, normals, std) -> Piece | None:
    """The torus that fits samples (n, 3) best, the best of the local minima to which starts lead;
    None where none follows them."""
    origin, axes, scale = frame_of(points, normals)
    local, noise = (points - origin) @ (axes.T / scale), np.broadcast_to(std / scale, len(points))
    facing = normals @ axes.T
    many, few = (_evenly(len(points), most) for most in (_MANY, _FEW))
    best, least = None, np.inf
    for start in _starts(local[many], facing[many], noise[many]):
        cost, torus = refined(start, local[few], noise[few], _FIRST)
        if cost < least and _is_ring(torus):
            best, least = torus, cost
        # As close as noise lets samples be.
        if 2.0 * least < len(few):
            break
    if best is None:
        return None
    cost, torus = refined(best, local[few], noise[few], _EVALUATIONS)
    if 2.0 * cost > _ASTRAY**2 * len(few):
        return None
    _, torus = refined(torus, local, noise, _EVALUATIONS)
    if not _is_ring(torus):
        return None
    _, outward, terms = value_gradient_terms(torus, local)
    if (outward * facing).sum() < 0.0:
        torus = np.append(torus[:7], -torus[7])
    basis = _basis(torus[3:6])
    weighted = (basis.T @ terms) / noise
    gram = weighted @ weighted.T
    # What samples leave open has a large deviation, and no infinite one.
    covariance = basis @ np.linalg.inv(gram + 1e-9 * gram.trace() * np.eye(7)) @ basis.T
    return Piece(Kind.TORUS, origin, axes, scale, torus, covariance)


def _evenly(count: int, most: int) -> np.ndarray:
    return np.linspace(0, count - 1, min(count, most)).astype(int)


def refined(torus, points, noise, evaluations: int) -> tuple[float, np.ndarray]:
    """Half the sum of squared distances of points (n, 3) from the nearest torus (8,), in
    deviations, and that torus: Levenberg-Marquardt steps of its seven parameters, with so many
    evaluations at most."""
    basis = _basis(torus[3:6])

    def moved(change) -> np.ndarray:
        new = torus + basis @ change
        new[3:6] /= np.sqrt(new[3:6] @ new[3:6])
        return new

    def slopes(change) -> np.ndarray:
        new = moved(change)
        rows = value_gradient_terms(new, points)[2]
        # That by the axis holds across it, as the axis is made a unit vector.
        rows[3:6] -= np.outer(new[3:6], new[3:6] @ rows[3:6])
        return (rows.T @ basis) / noise[:, None]

    found = least_squares(
        lambda change: value_gradient_terms(moved(change), points)[0] / noise,
        np.zeros(7),
        slopes,
        method="lm",
        max_nfev=evaluations,
    )
    return float(found.cost), moved(found.x)


def _basis(axis) -> np.ndarray:
    """(8, 7) changes of the coefficients of a torus whose axis stays a unit vector."""
    basis = np.zeros((8, 7))
    basis[[0, 1, 2, 6, 7], [0, 1, 2, 5, 6]] = 1.0
    u = any_tangent(axis)
    basis[3:6, 3], basis[3:6, 4] = u, cross(axis, u)
    return basis


def _is_ring(torus) -> bool:
    """Whether the tube leaves a hole, and samples show the bend of both radii."""
    return bool(abs(torus[7]) < torus[6] < _LARGEST and abs(torus[7]) * _LARGEST > 1.0)


def _starts(points, normals, noise) -> Iterator[np.ndarray]:
    """Tori (8,) about the axes that normals of quartics through parts of points (n, 3) meet."""
    order = np.argsort((points * points).sum(axis=1), kind="stable")
    for part in _PARTS:
        count = int(part * len(points))
        if count < Kind.QUARTIC.parameters:
            break
        some = np.sort(order[:count])
        frame = frame_of(points[some], normals[some])
        quartic = linear_fit(Kind.QUARTIC, points[some], *frame, noise[some])
        for axis, point in revolution_axes(points[some], quartic.at(points[some])[1]):
            yield _about(points[some], axis, point)


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


def _about(points, axis, point) -> np.ndarray:
    """The torus (8,) about an axis whose section fits points (n, 3) best: the circle (Kasa 1976)
    of their distances from the axis and heights along it."""
    offset = points - point
    height = offset @ axis
    rho = np.sqrt(np.maximum((offset * offset).sum(axis=1) - height**2, 0.0))
    columns = np.stack([rho, height, np.ones(len(rho))], axis=1)
    a, b, c = np.linalg.lstsq(columns, rho**2 + height**2, rcond=None)[0]
    ring, level = 0.5 * a, 0.5 * b
    tube = np.sqrt(max(c + ring**2 + level**2, 0.0))
    return np.concatenate([point + level * axis, axis, [ring, tube]])
