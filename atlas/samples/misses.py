"""Misses: how often the next samples lay off the faces that were predicted, and by how much."""

import numpy as np
from scipy.special import erfc

from touchatlas.patch.geometry.normal_error import SURE

# Number of touches that count.
LATEST = 8
# Standard deviations farther than which one right prediction in 500 million is.
_OFF = 6.0


def misses_of(distance, deviation, away) -> np.ndarray:
    """What the samples of one touch show of the faces that were predicted.

    Parameters
    ----------
    distance, deviation : (n,) float, length
        Distance of each from the predicted surface, and its standard deviation.
    away : (n,) float, length
        Distance of each from the nearest sample before it.

    Returns
    -------
    (3,) float
        Number of samples that lie on another face, sum of all ``away``, length, and sum of the
        squared distances of those, length^2.

    Examples
    --------
    >>> misses_of([0.1, 5.0], [0.1, 0.1], [2.0, 3.0]).tolist()
    [1.0, 5.0, 25.0]
    """
    distance, deviation = np.asarray(distance), np.asarray(deviation)
    off = np.abs(distance) > _OFF * deviation
    return np.array([off.sum(), np.sum(away), (distance[off] ** 2).sum()], float)


def deviation_with_misses(deviation, away, misses) -> np.ndarray:
    """Deviations (n,), length, whose 95 % intervals hold where a face may end unseen.

    That a face ends before the next sample is taken as a Poisson process along the distance from
    the nearest one: its rate is the number of misses over the sum of distances, the estimate of
    largest likelihood where distances are short against one over the rate. A face that ends is off
    by a normal error of the root mean square of the misses.

    Parameters
    ----------
    deviation, away : (n,) float, length
        Of the faces, and the distance from the nearest sample.
    misses : (k, 3) float
        See ``misses_of``; one row a touch.

    Examples
    --------
    One miss of 3 a length of 100 on average: at a distance of 1 the face is nearly believed.

    >>> found = deviation_with_misses(np.ones(2), np.array([1.0, 100.0]), [[1.0, 100.0, 9.0]])
    >>> found.round(2).tolist()
    [1.02, 2.69]
    """
    deviation = np.asarray(deviation, float)
    count, length, squares = np.sum(np.reshape(misses, (-1, 3)), axis=0)
    if not count > 0.0:
        return deviation
    missed, size = -np.expm1(-away * count / length), np.sqrt(squares / count)
    tiny = np.finfo(float).tiny
    low, high = deviation, np.maximum(deviation, size)
    # Halved 30 times, the bracket is a billionth of what it was.
    for _ in range(30):
        middle = 0.5 * (low + high)
        beyond = missed * erfc(SURE * middle / size / np.sqrt(2.0))
        beyond += (1.0 - missed) * erfc(SURE * middle / np.maximum(deviation, tiny) / np.sqrt(2.0))
        is_low = beyond > erfc(SURE / np.sqrt(2.0))
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return np.asarray(high)
