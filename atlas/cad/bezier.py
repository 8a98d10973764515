"""Bezier curves and faces as arrays of control points: values, derivatives, halves, Coons faces,
and how they are bent onto a surface that is known by its distance and normal.

A face has parameters u and v from 0 to 1; its first index of control points belongs to u. Formulas
are those of G. Farin, Curves and Surfaces for CAGD, 5th edition, 2002.

Control points are moved by least squares of the distances at fixed parameters, in Gauss-Newton
steps (Blake and Isard, Active Contours, 1998, chapter 6, for curves). Only the distance along the
normal counts, so that points may slide in the surface.
"""

from collections.abc import Callable
from math import comb

import numpy as np

# Signed distance (n,), length, and unit normal (n, 3) of a surface near points (n, 3).
At = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def bernstein(degree: int, t) -> np.ndarray:
    """(k, degree + 1) Bernstein polynomials at parameters t (k,) (Farin, section 5.1).

    Examples
    --------
    >>> bernstein(2, [0.5]).tolist()
    [[0.25, 0.5, 0.25]]
    """
    t, i = np.asarray(t, float)[:, None], np.arange(degree + 1)
    return np.array([comb(degree, k) for k in i]) * t**i * (1.0 - t) ** (degree - i)


def bernstein_slopes(degree: int, t) -> np.ndarray:
    """(k, degree + 1) derivatives of the Bernstein polynomials at t (k,) (Farin, section 5.3).

    Examples
    --------
    >>> bernstein_slopes(2, [0.0]).tolist()
    [[-2.0, 2.0, 0.0]]
    """
    lower = np.pad(bernstein(degree - 1, t), ((0, 0), (1, 1)))
    return degree * (lower[:, :-1] - lower[:, 1:])


def curve_points(control, t) -> np.ndarray:
    """(..., k, 3) points of curves with control points (..., n + 1, 3) at t (k,)."""
    return np.asarray(bernstein(control.shape[-2] - 1, t) @ control)


def face_points(control, u, v) -> np.ndarray:
    """(..., k, 3) points of faces with control points (..., n + 1, n + 1, 3) at u and v (k,)."""
    return _combined(control, bernstein, bernstein, u, v)


def face_normals(control, u, v) -> np.ndarray:
    """(..., k, 3) unit normals of faces at u and v (k,), zero where a face is degenerate.

    Examples
    --------
    >>> flat = np.array([[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]])
    >>> face_normals(flat, [0.5], [0.5]).tolist()
    [[0.0, 0.0, 1.0]]
    """
    slope_u = _combined(control, bernstein_slopes, bernstein, u, v)
    normal = np.cross(slope_u, _combined(control, bernstein, bernstein_slopes, u, v))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(normal / np.maximum(length, np.finfo(float).tiny))


def _combined(control, of_u, of_v, u, v) -> np.ndarray:
    degree = control.shape[-2] - 1
    return np.einsum("ki,kj,...ijc->...kc", of_u(degree, u), of_v(degree, v), control)


def halves(control) -> tuple[np.ndarray, np.ndarray]:
    """The two halves (..., n + 1, 3) of curves, which are the same curves (de Casteljau; Farin,
    section 5.4).

    Examples
    --------
    >>> first, second = halves(np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 0.0, 0.0]]))
    >>> first[-1].tolist(), second[0].tolist()
    ([1.0, 1.0, 0.0], [1.0, 1.0, 0.0])
    """
    rows, first, second = control, [control[..., 0, :]], [control[..., -1, :]]
    while rows.shape[-2] > 1:
        rows = 0.5 * (rows[..., :-1, :] + rows[..., 1:, :])
        first.append(rows[..., 0, :])
        second.append(rows[..., -1, :])
    return np.stack(first, axis=-2), np.stack(second[::-1], axis=-2)


def hermite(start, end, slope_start, slope_end) -> np.ndarray:
    """(..., 4, 3) the cubic with these points and slopes (..., 3) at its ends (Farin, section 7.5).

    Examples
    --------
    >>> zero, one = np.zeros(3), np.array([1.0, 0.0, 0.0])
    >>> (3.0 * hermite(zero, one, one, one))[:, 0].tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    return np.stack([start, start + slope_start / 3.0, end - slope_end / 3.0, end], axis=-2)


def coons(sides) -> np.ndarray:
    """(..., n + 1, n + 1, 3) bilinearly blended Coons faces (Farin, section 22.2).

    Parameters
    ----------
    sides : (..., 4, n + 1, 3)
        Control points of the sides in turn: v = 0, u = 1, v = 1 and u = 0, each from the end of the
        one before it.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> sides = np.stack([np.stack([a, b]) for a, b in zip(corners, np.roll(corners, -1, 0))])
    >>> coons(sides)[1, 1].tolist()
    [1.0, 1.0, 0.0]
    """
    low, right = sides[..., 0, :, None, :], sides[..., 1, None, :, :]
    high, left = sides[..., 2, ::-1, None, :], sides[..., 3, None, ::-1, :]
    v = np.linspace(0.0, 1.0, sides.shape[-2])[None, :, None]
    u = v.swapaxes(0, 1)
    across = (1.0 - v) * low + v * high
    ends = (1.0 - u) * across[..., :1, :, :] + u * across[..., -1:, :, :]
    # At the corners both ruled faces agree, so that the sides are kept exactly.
    return np.asarray(across + (1.0 - u) * left + u * right - ends)


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
    t = _middles(degree + 2)
    inner = bernstein(degree, t)[:, 1:-1]
    # The slopes at the ends are multiples of the first and the last step of control points.
    ends = np.zeros((2, degree - 1))
    ends[0, 0] = ends[1, -1] = degree
    for _ in range(3):
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
    along = _middles(degree + 2)
    u, v = (x.ravel() for x in np.meshgrid(along, along, indexing="ij"))
    inner = _inner(bernstein(degree, u), bernstein(degree, v))
    low, high = np.zeros(len(along)), np.ones(len(along))
    side_u, side_v = (
        np.concatenate([along, along, low, high]),
        np.concatenate([low, high, along, along]),
    )
    # Across the first two sides the slope is by v, across the others by u.
    is_v = np.repeat([True, False], 2 * len(along))[:, None]
    of_u = np.where(is_v, bernstein(degree, side_u), bernstein_slopes(degree, side_u))
    of_v = np.where(is_v, bernstein_slopes(degree, side_v), bernstein(degree, side_v))
    across, inner_across = np.einsum("ki,kj->kij", of_u, of_v), _inner(of_u, of_v)
    _, side_normal = _at_all(at, face_points(control, side_u, side_v))
    for _ in range(3):
        distance, normal = _at_all(at, face_points(control, u, v))
        lean = np.einsum("kij,fijc,fkc->fk", across, control, side_normal)
        # With a weight of 0.3 for slopes, neighbours are nearly tangent and distances a tenth
        # larger than without.
        rows = [_rows(inner, normal), 0.3 * _rows(inner_across, side_normal)]
        off = np.concatenate([-distance, -0.3 * lean], axis=1)
        step = _damped(np.concatenate(rows, axis=1), off)
        control = control.copy()
        control[:, 1:-1, 1:-1] += step.reshape(-1, degree - 1, degree - 1, 3)
    return control


def _middles(count: int) -> np.ndarray:
    """(count,) middles of equal parts of 0 to 1."""
    return np.asarray((np.arange(count) + 0.5) / count)


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
    """(e, m, 3) steps of control points of damped least squares, from rows (e, k, m, 3), (e, k)."""
    flat = rows.reshape(*rows.shape[:2], -1)
    # The damping, 0.1 of a distance, keeps control points from sliding in the surface.
    square = np.einsum("eki,ekj->eij", flat, flat) + 0.01 * np.eye(flat.shape[-1])
    step = np.linalg.solve(square, np.einsum("eki,ek->ei", flat, off)[..., None])
    return np.asarray(step.reshape(len(rows), -1, 3))
