"""Kinks of a contour: samples at which it runs over a sharp edge."""

from typing import NamedTuple

import numpy as np

from touchatlas.patch.geometry.arrays import cross

# Samples on either side of a possible kink.
SIDE = 8
# Least difference of the slopes on both sides of one: the tangent of 5 degrees.
LEAST_TURN = 0.0875


def kinks(
    points,
    normal,
    noise: float,
    stride: int = 1,
    least_turn: float = LEAST_TURN,
) -> np.ndarray:
    """(k,) indices of the samples nearest to the kinks of a curve, ascending.

    A cubic and a hinge, in the plane of the curve, are fitted to eight strides on either side of
    each sample. There is a kink where the hinge exceeds ``least_turn`` and eight
    deviations of the noise or of what cubic and hinge leave, whichever is more.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel.
    normal : (3,) float, unit
        Of the curve's plane.
    noise : float, length
    stride : int
        Every so many samples of a dense curve are tested.
    least_turn : float, no unit
        Least difference of the slopes on both sides: by default the tangent of 5 degrees.

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> roof = np.stack([x, 0.0 * x, -np.abs(x - 0.2)], axis=1)
    >>> kinks(roof, np.array([0.0, 1.0, 0.0]), 1e-3).tolist()
    [12]
    """
    return hinges(points, normal, stride).kinks(noise, least_turn)


class Hinges(NamedTuple):
    """Hinges that are fitted at samples of a curve.

    Parameters
    ----------
    places : (m,) int
        The samples, ascending.
    turn : (m,) float, no unit
        Absolute difference of the slopes on both sides.
    left : (m,) float, length
        Deviation of the samples from cubic and hinge.
    unit : (m,) float, 1/length
        Standard deviation of the turn for a unit of the deviation of samples.
    """

    places: np.ndarray
    turn: np.ndarray
    left: np.ndarray
    unit: np.ndarray

    def are_kinks(self, noise: float, least_turn: float = LEAST_TURN) -> np.ndarray:
        """(m,) whether the curve turns at each, or near it, by more than noise makes it."""
        deviation = self.unit * np.maximum(noise, self.left)
        return np.asarray(self.turn > np.maximum(least_turn, 8.0 * deviation))

    def kinks(self, noise: float, least_turn: float = LEAST_TURN) -> np.ndarray:
        """(k,) the samples nearest to the kinks, ascending."""
        if not len(self.places):
            return np.zeros(0, int)
        turn = np.where(self.are_kinks(noise, least_turn), self.turn, 0.0)
        # Hinges near a kink are large too: the largest nearby is the kink.
        around = np.concatenate([np.zeros(SIDE), turn, np.zeros(SIDE)])
        around = np.lib.stride_tricks.sliding_window_view(around, 2 * SIDE + 1).max(axis=1)
        return self.places[(turn > 0.0) & (turn == around)]


def hinges(points, normal, stride: int = 1) -> Hinges:
    """The hinges at samples of a curve (n, 3) in a plane, as for ``kinks``."""
    places, side = np.arange(3, max(len(points) - 3, 3), stride), SIDE * stride
    index = places[:, None] + np.arange(-side, side + 1)
    inside = (index >= 0) & (index < len(points))
    index = np.clip(index, 0, len(points) - 1)
    window = points[index] - points[places][:, None]
    along = window[:, -1] - window[:, 0]
    across = cross(normal, along)
    length = np.sqrt((along * along).sum(axis=1)).clip(np.finfo(float).tiny)[:, None]
    s = np.einsum("mwi,mi->mw", window, along) / length
    h = np.einsum("mwi,mi->mw", window, across) / length * inside
    reach = np.abs(s).max(axis=1).clip(np.finfo(float).tiny)
    t = s / reach[:, None]
    design = np.stack([np.abs(t), t**0, t, t**2, t**3], axis=2) * inside[:, :, None]
    inverse = np.linalg.pinv(design.transpose(0, 2, 1) @ design)
    coefficients = np.einsum("mij,mwj,mw->mi", inverse, design, h)
    left = h - np.einsum("mwi,mi->mw", design, coefficients)
    free = (inside.sum(axis=1) - design.shape[2]).clip(1)
    left = np.sqrt((left * left).sum(axis=1) / free)
    scale = 2.0 / reach
    unit = scale * np.sqrt(inverse[:, 0, 0].clip(0.0))
    return Hinges(places, scale * np.abs(coefficients[:, 0]), left, unit)
