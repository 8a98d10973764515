"""Friction: what it adds to a force, and the normal that is left without it."""

import numpy as np

from touchatlas.patch.geometry.arrays import cross


def across_path(force: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(n, 3) unit normals from forces and directions of travel (n, 3).

    Friction pulls along the path, so what is left of the force across it is normal to the surface,
    whatever the coefficient (Coulomb's law).

    Examples
    --------
    Friction of 0.3 while the tip travels along x on the plane z = 0:

    >>> across_path(np.array([[-0.3, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]]))
    array([[0., 0., 1.]])
    """
    left = force - (force * along).sum(axis=1)[:, None] * along
    length = np.sqrt((left * left).sum(axis=1))[:, None]
    normals: np.ndarray = left / np.maximum(length, 1e-300)
    return normals


def friction_of(force: np.ndarray, along: np.ndarray) -> float:
    """Coefficient of friction: the median, over readings, of the force against the direction of
    travel over that across it; 0 without readings.

    >>> friction_of(np.array([[-0.3, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]]))
    0.3
    """
    if not len(force):
        return 0.0
    against = -(force * along).sum(axis=1)
    across = np.sqrt(np.maximum((force * force).sum(axis=1) - against**2, 0.0))
    return max(0.0, float(np.median(against / np.maximum(across, 1e-300))))


def normals_with_friction(force: np.ndarray, plane_normal, friction: float) -> np.ndarray:
    """(n, 3) unit normals from forces (n, 3) on a tip that travels along w x n in the plane with
    the normal w, under a friction.

    The force is N (n - m t) with t along w x n, so that |F| = N sqrt(1 + m^2) and F w = N n w; the
    parts within the plane are at the angle atan(m / |n - (n w) w|). It needs no path, which has no
    direction at edges.

    Parameters
    ----------
    force : (n, 3) float
    plane_normal : (3,) float, unit
    friction : float

    Examples
    --------
    >>> w = np.array([0.0, 1.0, 0.0])
    >>> normals_with_friction(np.array([[-0.3, 0.0, 1.0]]), w, 0.3).round(12) + 0.0
    array([[0., 0., 1.]])
    """
    w = np.asarray(plane_normal, float)
    size = np.sqrt((force * force).sum(axis=1) / (1.0 + friction**2))
    lean = np.clip((force @ w) / np.maximum(size, 1e-300), -1.0, 1.0)
    inside = force - (force @ w)[:, None] * w
    inside /= np.maximum(np.sqrt((inside * inside).sum(axis=1)), 1e-300)[:, None]
    level = np.sqrt(1.0 - lean**2)
    turn = np.arctan2(friction, level)[:, None]
    # n x w turned by a right angle about w is n.
    turned = np.cos(turn) * inside + np.sin(turn) * cross(w[None], inside)
    normals: np.ndarray = lean[:, None] * w + level[:, None] * turned
    return normals
