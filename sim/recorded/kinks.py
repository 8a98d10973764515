"""The smooth part of a recorded curve: it may run on over an edge."""

from touchatlas.patch.geometry.kinks import SIDE, kinks

# Of a dense curve the samples on either side of a possible kink are this fraction. Doubled,
# curvature is taken for a kink.
_FRACTION = 1.0 / 12.0


def smooth_part(points, normal, noise: float, point):
    """(first, last) samples of a curve around a point between which it has no kink.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel.
    normal : (3,) float, unit
        Of the curve's plane.
    noise : float, length
    point : (3,) float, length, world

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> roof = np.stack([x, 0.0 * x, -np.abs(x - 0.2)], axis=1)
    >>> smooth_part(roof, np.array([0.0, 1.0, 0.0]), 1e-3, np.zeros(3))
    (0, 12)
    """
    stride = max(SIDE, int(_FRACTION * len(points))) // SIDE
    found = kinks(points, normal, noise, stride)
    nearest = int(((points - point) ** 2).sum(axis=1).argmin())
    # The kink itself is of both sides, but known to a stride only.
    before, after = found[found <= nearest] + (stride - 1), found[found > nearest] - (stride - 1)
    return int(before.max(initial=0)), int(after.min(initial=len(points) - 1))
