"""Checks of a caller's numbers, and small array operations."""

import reprlib
from numbers import Real

import numpy as np


def real(value) -> float:
    """One real number as a float, or NaN for anything else: no comparison with NaN is true.

    >>> real(2), real("2"), real(True), real([2.0])
    (2.0, nan, nan, nan)
    """
    if not isinstance(value, Real | np.ndarray):
        return np.nan
    array = np.asarray(value)
    return float(array) if array.ndim == 0 and array.dtype.kind in "iuf" else np.nan


def check_length(value, name: str) -> None:
    """ValueError for what is no length >= 0.

    >>> check_length(-1.0, "reach")
    Traceback (most recent call last):
    ValueError: reach is -1.0; it must be a length >= 0
    """
    if not 0.0 <= real(value) < np.inf:
        raise ValueError(f"{name} is {value}; it must be a length >= 0")


def frozen_array(values, shape: tuple[int | None, ...], name: str) -> np.ndarray:
    """Read-only float copy of ``values``. ValueError if the shape differs (None stands for any
    size) or a number is not finite."""
    array = _floats(values, name)
    if array.ndim != len(shape) or any(
        want is not None and got != want for got, want in zip(array.shape, shape, strict=True)
    ):
        wanted = "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"
        raise ValueError(f"{name} has shape {array.shape}; it must have shape {wanted}")
    if not np.isfinite(array).all():
        advice = "give finite numbers" if array.ndim < 2 else "remove those rows first"
        raise ValueError(f"{name} holds NaN or infinity; {advice}")
    array.flags.writeable = False
    return array


def _floats(values, name: str) -> np.ndarray:
    """A copy of ``values`` as floats."""
    try:
        # Complex numbers and dates would become floats.
        if np.asarray(values).dtype.kind in "cmM":
            raise TypeError
        return np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(
            f"{name} is {reprlib.repr(values)}; real numbers are needed, in rows of equal length"
        ) from None


def check_points(values, name: str) -> np.ndarray:
    """Read-only (n, 3) copy of points. ValueError if there is none or one is not finite."""
    points = frozen_array(values, (None, 3), name)
    if len(points) == 0:
        raise ValueError(f"{name} is empty; at least one point is needed")
    return points


def check_unit(values, name: str) -> np.ndarray:
    """Read-only (3,) copy of a unit vector. ValueError for a vector of another length."""
    vector = frozen_array(values, (3,), name)
    length = float(np.hypot(np.hypot(*vector[:2]), vector[2]))
    # Vectors that were stored as 32-bit floats differ from length 1 by 1e-7.
    if abs(length - 1.0) > 1e-6:
        raise ValueError(f"{name} has length {length:.6g}; it must be a unit vector")
    return vector


def check_units(values, count: int, name: str) -> np.ndarray:
    """Read-only (count, 3) copy of unit vectors. ValueError for vectors of another length, or
    another number of them."""
    vectors = frozen_array(values, (None, 3), name)
    if len(vectors) != count:
        raise ValueError(f"{name} are {len(vectors)}, but there are {count} points; give one each")
    length = np.sqrt((vectors * vectors).sum(axis=1))
    if count and (worst := np.abs(length - 1.0).max()) > 1e-6:
        raise ValueError(
            f"{name} differ from unit length by up to {worst:.3g}; they must be unit vectors"
        )
    return vectors


def has_powers(span: float, largest: float) -> bool:
    """Whether sixth powers of coordinates of a span and a largest size are in double precision.

    >>> has_powers(1e-60, 1.0), has_powers(1.0, 1e3)
    (False, True)
    """
    return span > 1e-50 and largest < 1e50


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3), broadcast. This takes a fifth of numpy's time on few vectors."""
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a2 * b3 - a3 * b2
    out[..., 1] = a3 * b1 - a1 * b3
    out[..., 2] = a1 * b2 - a2 * b1
    return out


def box_diagonal(points) -> float:
    """Diagonal of the bounding box of points (n, 3), length; 0 of none."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def nearest_to_mean(points) -> np.ndarray:
    """(3,) the one of points (n, 3) that is nearest to the mean of all."""
    offset = points - points.mean(axis=0)
    return np.asarray(points[(offset * offset).sum(axis=1).argmin()])


def evenly(values, most: int) -> np.ndarray:
    """At most so many of values (n, ...), evenly spread in their order.

    >>> evenly(np.arange(100), 3).tolist()
    [0, 49, 99]
    """
    if len(values) <= most:
        return np.asarray(values)
    return np.asarray(values[np.linspace(0, len(values) - 1, most).astype(int)])


def first_largest(values, begin) -> np.ndarray:
    """(k,) place of the first largest value of each of the rows of values (m,) that begin at
    ``begin`` (k,), ascending, none of them empty, and without NaN.

    >>> first_largest(np.array([1.0, 3.0, 3.0, 2.0]), np.array([0, 3])).tolist()
    [1, 3]
    """
    if not len(begin):
        return np.zeros(0, int)
    counts = np.diff(begin, append=len(values))
    best = np.flatnonzero(values == np.repeat(np.maximum.reduceat(values, begin), counts))
    return best[np.searchsorted(best, begin)]


def length_of_way(points) -> float:
    """Of straight lines through points (n, 3).

    >>> length_of_way([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    7.0
    """
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())
