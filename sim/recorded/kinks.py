"""Kinks of a recorded curve: where it runs on over an edge."""

import numpy as np

from touchatlas.patch.geometry.arrays import cross

# Samples on either side of a possible kink: this number, or this fraction of a dense curve; and
# the fewest near an end. With twice as many, curvature is taken for a kink.
_SIDE, _FRACTION, _LEAST_SIDE = 8, 1.0 / 12.0, 3
# A kink turns by more than 5 degrees, and by more than so many of its standard deviations. Twice
# the angle lets curves run over blunt edges.
_LEAST_TURN, _DEVIATIONS = np.tan(np.deg2rad(5.0)), 8.0


def smooth_part(points, normal, noise: float, point):
    """(first, last) samples of a curve around a point between which it has no kink.

    A cubic and a hinge, in the plane of the curve, through eight samples to either side or a
    twelfth of all: there is a kink where the hinge exceeds 5 degrees, and eight deviations of
    the noise or of what cubic and hinge leave, whichever is more.

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
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> roof = np.stack([x, 0.0 * x, -np.abs(x - 0.2)], axis=1)
    >>> smooth_part(roof, np.array([0.0, 1.0, 0.0]), 1e-3, np.zeros(3))
    (0, 12)
    """
    side = max(_SIDE, int(_FRACTION * len(points)))
    step = side // _SIDE
    places = np.arange(_LEAST_SIDE, len(points) - _LEAST_SIDE, step)
    turns = np.zeros(len(places))
    for number, i in enumerate(places.tolist()):
        window = points[max(i - side, 0) : i + side + 1] - points[i]
        turn, deviation = _hinge(window, normal, noise)
        if turn > max(_LEAST_TURN, _DEVIATIONS * deviation):
            turns[number] = turn
    # Hinges beside a kink see it too: the largest nearby is the kink.
    around = [turns[max(k - _SIDE, 0) : k + _SIDE + 1].max() for k in range(len(turns))]
    kinks = places[(turns > 0.0) & (turns == around)]
    nearest = int(((points - point) ** 2).sum(axis=1).argmin())
    # The kink itself is of both sides, but known to a step only.
    before, after = kinks[kinks <= nearest] + (step - 1), kinks[kinks > nearest] - (step - 1)
    return int(before.max(initial=0)), int(after.min(initial=len(points) - 1))


def _hinge(window, normal, noise):
    """Turn of the hinge at the origin of a window (w, 3), and its standard deviation."""
    along = window[-1] - window[0]
    across = cross(normal, along)
    length = np.sqrt(max(float(along @ along), np.finfo(float).tiny))
    s, h = window @ along / length, window @ across / length
    reach = max(float(np.abs(s).max()), np.finfo(float).tiny)
    t = s / reach
    design = np.stack([np.abs(t), t**0, t, t**2, t**3], axis=1)
    inverse = np.linalg.pinv(design.T @ design)
    coefficients = inverse @ (design.T @ h)
    left = h - design @ coefficients
    spread = max(noise, np.sqrt(left @ left / max(len(h) - 5, 1)))
    scale = 2.0 / reach
    return scale * abs(coefficients[0]), scale * spread * np.sqrt(max(inverse[0, 0], 0.0))
