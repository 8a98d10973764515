"""Finer steps: a contour is sampled more finely where it bends more."""

from collections.abc import Callable

import numpy as np

from touchatlas.patch.geometry.arrays import cross

# How often a step is halved at most. Doubled, bends of an eighth of the radius are followed.
HALVINGS = 3


def whole_steps(length: float) -> int:
    """Number of whole steps in a curve of so many steps."""
    # A curve of a whole number of steps has its last one.
    return int(length + 1e-9)


def last_steps(length: float) -> np.ndarray:
    """Arc lengths (n,), in steps, of the samples after the last whole step of a curve on which
    contact is lost after ``length`` steps.

    Where contact is lost, the probe goes half as far, three times: so the last sample lies within
    an eighth of a step of the end.

    Examples
    --------
    >>> last_steps(5.8).tolist()
    [5.5, 5.75]
    """
    at, found = float(whole_steps(length)), []
    for halving in range(1, HALVINGS + 1):
        if at + 0.5**halving <= length:
            at += 0.5**halving
            found.append(at)
    return np.array(found)


def finer_steps(points, turn: float, middles: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Arc lengths (n,), in steps, at which a curve turns by ``turn`` at most from one to the next.

    The curve is given at arc lengths 0, 1, 2, ... Steps beside a point at which the chords turn by
    more are halved, up to three times.

    Parameters
    ----------
    points : (k, 3) float, length
        Where the curve begins, and after each step.
    turn : float, rad
    middles : function from arc lengths (m,), in steps, to points (m, 3) of the curve

    Examples
    --------
    An octagon turns by 45 degrees, so its steps are halved twice::

        angles = np.pi / 4.0 * np.arange(9)
        circle = lambda s: np.stack([np.cos(np.pi / 4 * s), np.sin(np.pi / 4 * s), 0 * s], 1)
        finer_steps(circle(np.arange(9.0)), 0.2, circle)  # 33 numbers, 0.25 apart
    """
    at = np.arange(len(points), dtype=float)
    for _ in range(HALVINGS):
        chords = np.diff(points, axis=0)
        across = cross(chords[:-1], chords[1:])
        bends = np.arctan2(
            np.sqrt((across * across).sum(axis=1)), (chords[:-1] * chords[1:]).sum(axis=1)
        )
        split = np.zeros(len(chords), bool)
        split[:-1] = bends > turn
        split[1:] |= bends > turn
        if not split.any():
            break
        before = np.flatnonzero(split)
        new = 0.5 * (at[before] + at[before + 1])
        at = np.insert(at, before + 1, new)
        points = np.insert(points, before + 1, middles(new), axis=0)
    return at
