"""A torus in closed form: the distance from a tube about a circle, and its derivatives.

Its eight coefficients are the centre of the circle (3), its axis, a unit vector (3), its radius R,
and the radius r of the tube, negative where the outside of the body lies in the tube.
"""

import numpy as np

from touchatlas.atlas.pieces.cone import split_about_axis


def value_gradient_terms(torus, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed distances (n,) from a torus (8,), their gradients (n, 3), and their derivatives by its
    coefficients (8, n) at points (n, 3).

    With h along the axis and rho from it, d^2 = (rho - R)^2 + h^2, and the distance is
    sign(r) d - r. That by the axis holds across it.

    >>> ring = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 5.0, 2.0])
    >>> value, gradient, _ = value_gradient_terms(ring, np.array([[8.0, 0.0, 0.0]]))
    >>> float(value[0]), gradient[0].tolist()
    (1.0, [1.0, 0.0, 0.0])
    """
    offset, height, radial, rho, distance = _split(torus, points)
    axis, ring, side = torus[3:6], torus[6], np.sign(torus[7])
    across = rho - ring
    out = np.empty((8, len(points)))
    gradient = (across[:, None] * radial + height[:, None] * axis) * (side / distance)[:, None]
    out[:3] = -gradient.T
    # d rho / d axis = -h q / rho and d h / d axis = q, with q the offset from the centre.
    out[3:6] = side * height * ring / (rho * distance) * offset.T
    out[6] = -side * across / distance
    out[7] = -1.0
    return side * distance - torus[7], gradient, out


def outward_change(torus) -> np.ndarray:
    """(8,) change of the coefficients, over the distance by which it moves the surface outward: the
    radius of the tube."""
    return np.eye(len(torus))[7]


def hessians(torus, points) -> np.ndarray:
    """(n, 3, 3) second derivatives of the distance from a torus at points (n, 3): 1/d along the
    tube's meridian, (rho - R) / (d rho) about the axis."""
    _, height, radial, rho, distance = _split(torus, points)
    axis, side = torus[3:6], np.sign(torus[7])
    about = np.cross(axis, radial)
    along = rho - torus[6]
    meridian = (along[:, None] * axis - height[:, None] * radial) / distance[:, None]
    outer = meridian[:, :, None] * meridian[:, None, :] / distance[:, None, None]
    bend = (along / (distance * rho))[:, None, None]
    return np.asarray(side * (outer + bend * about[:, :, None] * about[:, None, :]))


def _split(torus, points):
    """Those of ``split_about_axis``, and distances (n,) from the circle."""
    offset, height, radial, rho = split_about_axis(torus, points)
    distance = np.maximum(np.hypot(rho - torus[6], height), np.finfo(float).tiny)
    return offset, height, radial, rho, distance
