"""Bezier curves and faces as arrays of control points: values, derivatives, halves, Coons faces.

A face has parameters u and v from 0 to 1; its first index of control points belongs to u. Formulas
are those of G. Farin, Curves and Surfaces for CAGD, 5th edition, 2002.
"""

from math import comb

import numpy as np


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


def face_slopes(control, u, v) -> tuple[np.ndarray, np.ndarray]:
    """(..., k, 3) derivatives of faces by u and by v, at u and v (k,), length."""
    return (
        _combined(control, bernstein_slopes, bernstein, u, v),
        _combined(control, bernstein, bernstein_slopes, u, v),
    )


def face_normals(control, u, v) -> np.ndarray:
    """(..., k, 3) unit normals of faces at u and v (k,), zero where a face is degenerate.

    Examples
    --------
    >>> flat = np.array([[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]])
    >>> face_normals(flat, [0.5], [0.5]).tolist()
    [[0.0, 0.0, 1.0]]
    """
    normal = np.cross(*face_slopes(control, u, v))
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


def hermite(start, end, slope_start, slope_end, degree: int) -> np.ndarray:
    """(..., degree + 1, 3) the cubic with these points and slopes at its ends, its degree raised to
    ``degree`` >= 3 (Farin, sections 7.5 and 6.1).

    Examples
    --------
    >>> zero, one = np.zeros(3), np.array([1.0, 0.0, 0.0])
    >>> hermite(zero, one, one, one, 4)[:, 0].tolist()
    [0.0, 0.25, 0.5, 0.75, 1.0]
    """
    rows = np.stack([start, start + slope_start / 3.0, end - slope_end / 3.0, end], axis=-2)
    for n in range(4, degree + 1):
        share = (np.arange(1, n) / n)[:, None]
        inner = share * rows[..., :-1, :] + (1.0 - share) * rows[..., 1:, :]
        rows = np.concatenate([rows[..., :1, :], inner, rows[..., -1:, :]], axis=-2)
    return np.asarray(rows)


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
