"""The displaced curve: two curves of a surface meet where their planes cross."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour


class Crossing(NamedTuple):
    """Two curves, by index, and their distance along the line of their planes, in deviations."""

    first: int
    second: int
    miss: float


def crossings(contours: tuple[Contour, ...], origin, noise_floor: float) -> tuple[Crossing, ...]:
    """How far each two curves miss each other where their planes cross.

    Each curve is a polynomial near the line in which the planes cross, so that no shape of the
    surface is assumed. Curves that do not reach the line, or have nearly one plane, are left out.

    Parameters
    ----------
    contours : tuple of Contour
    origin : (3,) float, length, world
        Of several places where a curve meets the line, the nearest to this point is taken.
    noise_floor : float, length
        Least noise: rounding.

    Examples
    --------
    Three curves of a plane, of which the second lies ten noises above the others:

    >>> from touchatlas.patch.geometry.contour import ContourEnd, SamplingPlane
    >>> s = np.linspace(-1.0, 1.0, 21)[:, None]
    >>> def curve(angle, height):
    ...     along, across = np.array([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0]])
    ...     plane = SamplingPlane(np.zeros(3), np.cross(along, across))
    ...     points = s * along + height * across
    ...     return Contour(points, plane, 0.01, (ContourEnd.LENGTH_REACHED,) * 2)
    >>> curves = curve(0.0, 0.0), curve(1.0, 0.1), curve(2.0, 0.0)
    >>> found = crossings(curves, np.zeros(3), 0.0)
    >>> [crossing.miss > 4.0 for crossing in found], displaced_curves(found, 3, 4.0)
    ([True, False, True], (1,))
    """
    cleaned = [without_bad_contacts(contour) for contour in contours]
    found = []
    for (i, one), (j, other) in combinations(enumerate(cleaned), 2):
        line = cross(one.plane.normal, other.plane.normal)
        sine = float(np.sqrt(line @ line))
        # Planes within 10 degrees of each other have no crossing.
        if sine < 0.17:
            continue
        line /= sine
        place = _common_point(one, other, line, origin)
        first, second = (_height(c, place, line, noise_floor) for c in (one, other))
        if first and second:
            deviation = max(np.sqrt(first[1] + second[1]), np.finfo(float).tiny)
            found.append(Crossing(i, j, abs(first[0] - second[0]) / float(deviation)))
    return tuple(found)


def _common_point(one: Contour, other: Contour, line, origin) -> np.ndarray:
    """(3,) point of both planes that is nearest to the origin."""
    rows = np.stack([one.plane.normal, other.plane.normal, line])
    off = [one.plane.normal @ one.plane.point, other.plane.normal @ other.plane.point]
    return np.linalg.solve(rows, np.array([*off, line @ origin]))


def _height(contour: Contour, place, line, noise_floor: float) -> tuple[float, float] | None:
    """Where a curve meets a line of its plane, from a place on the line, and the variance; None
    where it does not cross the line."""
    offset = contour.points_in_plane - place
    along, height = offset @ cross(contour.plane.normal, line), offset @ line
    turns = np.flatnonzero((along[1:] > 0.0) != (along[:-1] > 0.0))
    if not len(turns):
        return None
    middle = int(turns[np.abs(height[turns]).argmin()])
    # At the ends of the longer arm the curve may turn back.
    far = np.flatnonzero(np.abs(along) > 0.7 * np.abs(along).max())
    near = slice(
        int(far[far <= middle].max(initial=-1)) + 1, int(far[far > middle].min(initial=len(along)))
    )
    along, height = along[near], height[near]
    freedom = len(along) - 5
    if freedom < 1:
        return None
    scale = float(np.abs(along).max())
    # Degree 4 follows an arc of 90 degrees to 2e-4 of its radius.
    design = (along[:, None] / scale) ** np.arange(5.0)
    inverse = np.linalg.pinv(design)
    found = inverse @ height
    rest = height - design @ found
    noise = max(contour.noise_std, noise_floor)
    # Noise along the curve changes its height by the slope; scatter beyond noise is detail.
    variance = max(noise**2 * (1.0 + (found[1] / scale) ** 2), float(rest @ rest) / freedom)
    return float(found[0]), float(inverse[0] @ inverse[0]) * variance


def displaced_curves(found: tuple[Crossing, ...], count: int, largest: float) -> tuple[int, ...]:
    """Indices of the displaced curves; empty where the misses do not show which they are.

    The curve is left out without which the others miss each other least, until they all meet. It
    must be more probable than the next best one by far, and most of the curves must remain.

    Parameters
    ----------
    found : tuple of Crossing
    count : int
        Of the curves.
    largest : float
        Miss that noise explains, in deviations.
    """
    out: list[int] = []
    while _worst(found) > largest:
        if len(out) >= (count - 1) // 2:
            return ()
        left = [i for i in range(count) if i not in out]
        least, next_least = sorted((_worst(_without(found, i)), i) for i in left)[:2]
        # A likelihood ratio of 250 tells one curve from another.
        if next_least[0] ** 2 - least[0] ** 2 < 11.0:
            return ()
        out.append(least[1])
        found = _without(found, least[1])
    return tuple(sorted(out))


def _without(found: tuple[Crossing, ...], curve: int) -> tuple[Crossing, ...]:
    return tuple(c for c in found if curve not in (c.first, c.second))


def _worst(found: tuple[Crossing, ...]) -> float:
    """The largest miss."""
    return max((c.miss for c in found), default=0.0)
