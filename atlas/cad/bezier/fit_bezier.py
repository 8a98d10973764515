"""Fit Bezier: curves and faces are bent onto a surface that is known by its distance and normal.

Control points are moved by the least squares of the distances at parameters that stay, a
Gauss-Newton step (Blake and Isard, Active Contours, 1998, chapter 6, for curves). Only the distance
along the normal counts, so that points may slide in the surface.
"""

from collections.abc import Callable

import numpy as np

from touchatlas.atlas.cad.bezier.bezier import (
    bernstein,
    bernstein_slopes,
    curve_points,
    face_points,
)

# Signed distance (n,), length, and unit normal (n, 3) of a surface near points (n, 3).
At = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

# Gauss-Newton steps: each squares the relative error. Doubled, nothing changes.
_STEPS = 3
# Parameters along a curve, or along each side of a face, at which it is compared with the surface,
# beyond the degree. Doubled, fits take four times as long and err little less.
_MORE = 2
# Weight of the step of a control point, over that of a distance, no unit. Doubled, control points
# slide less in the surface.
_DAMPED = 0.1
# Weight of the slope across a side, over that of a distance, no unit. Doubled, angles between
# neighbours are a quarter smaller, and distances a tenth larger.
_TANGENT = 0.3


def middles(count: int) -> np.ndarray:
    """(count,) middles of equal parts of 0 to 1.

    Examples
    --------
    >>> middles(2).tolist()
    [0.25, 0.75]
    """
    return np.asarray((np.arange(count) + 0.5) / count)


def fit_curves(control, at: At, normals) -> np.ndarray:
    """Curves (e, n + 1, 3) bent onto a surface between their ends, which stay.

    Parameters
    ----------
    control : (e, n + 1, 3) float, length
    at : function
    normals : (e, 2, 3) float, unit
        Of the surface at both ends, to which the curves are made normal there.
    """
    degree = control.shape[1] - 1
    t = middles(degree + _MORE)
    inner = bernstein(degree, t)[:, 1:-1]
    # The slopes at the ends are multiples of the first and the last step of control points.
    ends = np.zeros((2, degree - 1))
    ends[0, 0] = ends[1, -1] = degree
    for _ in range(_STEPS):
        points = curve_points(control, t)
        distance, normal = _at_all(at, points)
        steps = control[:, [1, -2]] - control[:, [0, -1]]
        across = degree * np.einsum("ekc,ekc->ek", steps, normals)
        rows = [_rows(inner, normal), _rows(ends, normals)]
        off = np.concatenate([-distance, -across], axis=1)
        step = _damped(np.concatenate(rows, axis=1), off)
        control = control.copy()
        control[:, 1:-1] += step
    return control


def fit_faces(control, at: At) -> np.ndarray:
    """Faces (f, n + 1, n + 1, 3) bent onto a surface between their sides, which stay, and made
    tangent to it along them."""
    degree = control.shape[1] - 1
    u, v = (x.ravel() for x in np.meshgrid(*2 * [middles(degree + _MORE)], indexing="ij"))
    inner = _inner(bernstein(degree, u), bernstein(degree, v))
    along, low, high = middles(degree + _MORE), np.zeros(degree + _MORE), np.ones(degree + _MORE)
    side_u = np.concatenate([along, along, low, high])
    side_v = np.concatenate([low, high, along, along])
    is_across_v = np.repeat([True, False], 2 * len(along))
    tables = (bernstein(degree, side_u), bernstein(degree, side_v))
    slopes = (bernstein_slopes(degree, side_u), bernstein_slopes(degree, side_v))
    tables = (
        np.where(is_across_v[:, None], tables[0], slopes[0]),
        np.where(is_across_v[:, None], slopes[1], tables[1]),
    )
    across = np.einsum("ki,kj->kij", *tables).reshape(len(side_u), -1)
    inner_across = _inner(*tables)
    _, side_normal = _at_all(at, face_points(control, side_u, side_v))
    for _ in range(_STEPS):
        distance, normal = _at_all(at, face_points(control, u, v))
        slope = np.einsum("kp,fpc->fkc", across, control.reshape(len(control), -1, 3))
        lean = np.einsum("fkc,fkc->fk", slope, side_normal)
        rows = [_rows(inner, normal), _TANGENT * _rows(inner_across, side_normal)]
        off = np.concatenate([-distance, -_TANGENT * lean], axis=1)
        step = _damped(np.concatenate(rows, axis=1), off)
        control = control.copy()
        control[:, 1:-1, 1:-1] += step.reshape(-1, degree - 1, degree - 1, 3)
    return control


def _inner(of_u, of_v) -> np.ndarray:
    """(k, m) weights of the inner control points of a face."""
    return np.einsum("ki,kj->kij", of_u[:, 1:-1], of_v[:, 1:-1]).reshape(len(of_u), -1)


def _at_all(at: At, points) -> tuple[np.ndarray, np.ndarray]:
    """Distances (e, k) and normals (e, k, 3) at points (e, k, 3)."""
    distance, normal = at(np.ascontiguousarray(points.reshape(-1, 3)))
    return distance.reshape(points.shape[:2]), normal.reshape(points.shape)


def _rows(weights, normal) -> np.ndarray:
    """(e, k, m, 3) change along normals (e, k, 3) with each coordinate of m control points, by
    their weights (k, m)."""
    return np.asarray(weights[None, :, :, None] * normal[:, :, None, :])


def _damped(rows, off) -> np.ndarray:
    """(e, m, 3) steps of control points of least squares, from rows (e, k, m, 3), (e, k)."""
    flat = rows.reshape(*rows.shape[:2], -1)
    square = np.einsum("eki,ekj->eij", flat, flat) + _DAMPED**2 * np.eye(flat.shape[-1])
    step = np.linalg.solve(square, np.einsum("eki,ek->ei", flat, off)[..., None])
    return np.asarray(step.reshape(len(rows), -1, 3))
