"""A cone in closed form: the distance from one nappe of it, and its derivatives.

Its seven coefficients are the apex (3), the axis, a unit vector along which it widens (3), and half
the angle of the apex, negative where the outside of the body lies about the axis.
"""

import numpy as np

_TINY = float(np.finfo(float).tiny)


def value_gradient_terms(cone, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed distances (n,) from a cone (7,), their gradients (n, 3), and their derivatives by its
    coefficients (7, n) at points (n, 3).

    With h along the axis and rho from it, the distance is sign(α) (rho cos α - h sin |α|). That by
    the axis holds across it.

    >>> cone = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.25 * np.pi])
    >>> value, gradient, _ = value_gradient_terms(cone, np.array([[2.0, 0.0, 0.0]]))
    >>> value.round(6).tolist(), gradient[0].round(6).tolist()
    ([1.414214], [0.707107, 0.0, -0.707107])
    """
    offset, height, radial, rho = split_about_axis(cone, points)
    side, cosine, sine = np.sign(cone[6]), np.cos(cone[6]), np.sin(np.abs(cone[6]))
    out = np.empty((7, len(points)))
    gradient = side * (cosine * radial - sine * cone[3:6])
    out[:3] = -gradient.T
    # d rho / d axis = -h q / rho and d h / d axis = q, with q the offset from the apex.
    out[3:6] = -side * (cosine * height / rho + sine) * offset.T
    out[6] = -(sine * rho + cosine * height)
    return side * (cosine * rho - sine * height), gradient, out


def outward_change(cone) -> np.ndarray:
    """(7,) change of the coefficients, over the distance by which it moves the surface outward: the
    apex along the axis."""
    out = np.zeros(7)
    out[:3] = -cone[3:6] / np.sin(cone[6])
    return out


def hessians(cone, points) -> np.ndarray:
    """(n, 3, 3) second derivatives of the distance from a cone at points (n, 3): cos α / rho about
    the axis."""
    _, _, radial, rho = split_about_axis(cone, points)
    about = np.cross(cone[3:6], radial)
    bend = np.sign(cone[6]) * np.cos(cone[6]) / rho
    return np.asarray(bend[:, None, None] * about[:, :, None] * about[:, None, :])


def split_about_axis(form, points):
    """Offsets (n, 3) from a point of the axis of a cone or torus, heights (n,) along the axis, unit
    radial directions (n, 3), and distances (n,) from the axis."""
    offset, axis = points - form[:3], form[3:6]
    height = offset @ axis
    radial = offset - height[:, None] * axis
    rho = np.maximum(np.sqrt((radial * radial).sum(axis=1)), _TINY)
    return offset, height, radial / rho[:, None], rho
