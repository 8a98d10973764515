"""Shift: how far the object moved between two touches, as normal equations, which add up."""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas.records.options import Levels

# Samples of a touch that count as independent: those of a contour share most of their error.
_INDEPENDENT = 5.0


@dataclass(frozen=True, eq=False)
class Shift:
    """Normal equations of the shift t of the object that moves a touch onto the body of the touches
    before it: distances d over deviations s, with the normals n there, d = n . t.

    Parameters
    ----------
    matrix : (3, 3) float, 1/length^2
        Sum of n n^T / s^2.
    vector : (3,) float, 1/length
        Sum of n d / s^2.
    square : float
        Sum of d^2 / s^2.
    """

    matrix: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    vector: np.ndarray = field(default_factory=lambda: np.zeros(3))
    square: float = 0.0

    def __add__(self, other: "Shift") -> "Shift":
        return Shift(
            self.matrix + other.matrix, self.vector + other.vector, self.square + other.square
        )

    @property
    def most_probable(self) -> np.ndarray:
        """(3,) the shift, length, world, along directions in which it is known to ten times the
        least deviation."""
        return np.asarray(np.linalg.lstsq(self.matrix, self.vector, rcond=1e-2)[0])

    def left(self, shift) -> float:
        """Sum of squares that a shift (3,) leaves unexplained."""
        return float(self.square - 2.0 * shift @ self.vector + shift @ self.matrix @ shift)


def shift_of(
    distance, normal, variance, freedom: float, levels: Levels = Levels(), contours=None
) -> Shift:
    """What samples at distances (n,), length, from a surface with normals (n, 3) and variances (n,)
    say of a shift. Errors follow a Student t: what a shift does not explain weighs less, by
    iteratively reweighted least squares. A shift moves all samples: nothing is said where more
    than the level ``passed`` of those that it surely moves are on the surface all the same, as
    beside a step that no contour has crossed. And nothing where one of ``contours`` (n,) int tells
    of it alone: a few samples that the surface misses are always explained by some shift."""
    count = len(distance)
    if not count:
        return Shift()
    variance = np.maximum(variance, np.finfo(float).tiny)
    weight = min(1.0, _INDEPENDENT / count) / variance
    found, own = Shift(), weight
    explained = np.zeros(count)
    for _ in range(5):
        scaled = own[:, None] * normal
        found = Shift(normal.T @ scaled, scaled.T @ distance, float(own @ distance**2))
        rest = distance - normal @ found.most_probable
        explained = own * (distance**2 - rest**2)
        own = weight * (freedom + 1.0) / (freedom + rest**2 / variance)
    moved = normal @ found.most_probable
    far = levels.sure * np.sqrt(variance)
    surely, off = np.abs(moved) > far, np.abs(distance)
    still = surely & (off < far) & (off < np.abs(distance - moved))
    if still.sum() > levels.passed * surely.sum():
        return Shift()
    if contours is not None and _one_alone(explained, contours, levels):
        return Shift()
    return found


def _one_alone(explained, contours, levels: Levels) -> bool:
    """Whether squares that a shift surely explains at samples (n,) are those of one of ``contours``
    (n,) int, but for a share that may be by chance."""
    every = explained.sum()
    largest = np.bincount(contours, explained).max()
    return bool(every > levels.sure**2 and largest > (1.0 - levels.passed) * every)
