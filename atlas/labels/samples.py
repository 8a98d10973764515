"""ContourSamples: the samples of contours as arrays, with normals within their sampling planes."""

import itertools
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.samples.sample_pool import contours_of_planes
from touchatlas.patch.geometry.arrays import box_diagonal, cross
from touchatlas.patch.geometry.kinks import Hinges, hinges
from touchatlas.patch.geometry.normal_error import MOST_TILT

# Samples of a window that gives a normal: a quadratic leaves two degrees of freedom. Doubled,
# normals are a third as noisy, and wrong within nine samples of an edge.
_WINDOW = 5
# By how much a window to one side must have smaller squared residuals than the centred one, in
# variances of the noise: with a chance of 1e-3 noise does (chi-square, two degrees of freedom).
# Doubled, normals beside blunt edges are of both sides.
_MUCH_BETTER = 14.0
# Least number of samples of a face besides those of the contour with most of them: as many as its
# slope across that contour needs. Doubled, narrow faces take another touch.
_OTHERS = 3
# Longest step along a contour over its median step; a longer one begins a new contour. Doubled,
# nothing changes but where a contour was interrupted.
_LONGEST_STEP = 4.0


@dataclass(frozen=True, eq=False)
class ContourSamples:
    """Samples in order of their contours.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward, perpendicular to the contour within its sampling plane: the projection of the
        surface normal to that plane.
    outward : (n, 3) float, unit, world
        Estimates of the surface normal itself. They say which samples are next to each other.
    planes : (n, 3) float, unit, world
        Normal of the sampling plane; zero for a point of no curve.
    contours : (n,) int
        Number of the contour, ascending.
    touches : (n,) int
        Number of the group of contours that were tracked from one contact, ascending.
    steps : (n,) float, length
        Median step of the sample's contour; the distance to the nearest other one for a point of
        no curve.
    std : float, length
        Standard deviation of the distance of the surest samples from the surface: noise, and the
        lack of fit that is borne.
    stds : (n,) float, length
        That of each sample.
    levels : Levels
        What is enough to decide about them.
    tip : float, length
        Radius of the ball whose centres they are: no convex edge of their surface is sharper.
    known_hinges : list
        ``hinges`` of the first contours, where they are known.
    """

    points: np.ndarray
    normals: np.ndarray
    outward: np.ndarray
    planes: np.ndarray
    contours: np.ndarray
    touches: np.ndarray
    steps: np.ndarray
    std: float
    stds: np.ndarray
    levels: Levels = Levels()
    tip: float = 0.0
    known_hinges: list[Hinges] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box about all, length."""
        return box_diagonal(self.points)

    @cached_property
    def hinges(self) -> list[Hinges]:
        """Hinges at the samples of each contour, by which kinks are found."""
        known = self.known_hinges
        bounds = np.append(np.flatnonzero(np.diff(self.contours, prepend=-1)), len(self))
        new = itertools.pairwise(bounds[len(known) :].tolist())
        return known + [hinges(self.points[a:b], self.planes[a]) for a, b in new]

    def are_of_several_contours(self, some) -> bool:
        """Whether some samples (m,) determine more than a curve in a plane."""
        counts = np.bincount(self.contours[some])
        return bool(len(some) - counts.max(initial=0) >= _OTHERS)


def contour_samples(
    points,
    outward,
    planes,
    std: float,
    levels: Levels = Levels(),
    stds=None,
    numbers=None,
    measured=None,
    tip: float = 0.0,
    before: ContourSamples | None = None,
) -> ContourSamples:
    """Samples with contours and normals, from the columns of a sample pool.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel, contour after contour.
    outward : (n, 3) float, unit, world
        Estimates of the surface normals.
    planes : (n, 3) float, unit, world
        Normals of the sampling planes; zero for points of no curve.
    std : float, length, > 0
        Of the surest samples.
    levels : Levels
    stds : (n,) float, length, > 0, optional
        Of each sample; all are alike without.
    numbers : (n,) int, optional
        Of the contours, ascending. Without, one begins where the plane changes.
    measured : (n,) bool, optional
        Whether ``outward`` was measured: about an edge it is surer than a tangent of the contour.
    tip : float, length
        Radius of the ball whose centres they are.
    before : ContourSamples, optional
        The first of the samples: what is of one contour is not found again. The result is the same
        without it.
    """
    stds = np.full(len(points), float(std)) if stds is None else stds
    numbers = contours_of_planes(planes) if numbers is None else numbers
    contours, steps = split_contours(points, numbers)
    loose = np.flatnonzero(~planes.any(axis=1))
    steps[loose] = _spacings(points[loose])
    columns = points, planes, contours, stds
    first = None if before is None or not _begin_with(before, *columns) else before
    count = 0 if first is None else len(first)
    normals = plane_normals(*(column[count:] for column in columns))
    if first is not None:
        normals = np.concatenate([first.normals, normals])
    normals[loose] = outward[loose]
    side = np.where((normals * outward).sum(axis=1) < 0.0, -1.0, 1.0)
    # The probe stays on one side, so one sign holds for a whole contour.
    votes = np.bincount(contours, side, contours[-1] + 1)
    normals = normals * np.where(votes < 0.0, -1.0, 1.0)[contours][:, None]
    if measured is not None and measured.any():
        within = outward - (outward * planes).sum(axis=1)[:, None] * planes
        length = np.sqrt((within * within).sum(axis=1))
        # A normal across the plane says nothing within it.
        sure = measured & (length > np.sin(MOST_TILT))
        normals[sure] = within[sure] / length[sure, None]
    touches = group_contours(points, contours, steps)
    own = contours, touches, steps, float(std), stds, levels, tip
    known = [] if first is None else vars(first).get("hinges", first.known_hinges)
    return ContourSamples(points, normals, outward, planes, *own, known)


def _begin_with(before: ContourSamples, points, planes, contours, stds) -> bool:
    """Whether whole contours of samples with some columns are those known before."""
    names, count = ("points", "planes", "contours", "stds"), len(before)
    columns = zip(names, (points, planes, contours, stds), strict=True)
    return not np.isin(contours[count:], contours[:count]).any() and all(
        np.array_equal(getattr(before, name), column[:count]) for name, column in columns
    )


def split_contours(points, numbers) -> tuple[np.ndarray, np.ndarray]:
    """Number of the contour (n,) and its median step (n,) of samples in order of travel, with
    ``numbers`` (n,) that change where another one was begun."""
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    new = numbers[1:] != numbers[:-1]
    numbers = np.concatenate([[0], np.cumsum(new)])
    within = _medians(step[~new], numbers[1:][~new], numbers[-1] + 1)
    far = step > _LONGEST_STEP * within[numbers[1:]]
    numbers = np.concatenate([[0], np.cumsum(new | far)])
    inside = numbers[1:] == numbers[:-1]
    return numbers, _medians(step[inside], numbers[1:][inside], numbers[-1] + 1)[numbers]


def _spacings(points) -> np.ndarray:
    """(n,) distances of points (n, 3) to the nearest other one; zero of one alone."""
    if len(points) < 2:
        return np.zeros(len(points))
    return np.asarray(cKDTree(points).query(points, k=2)[0][:, 1])


def group_contours(points, contours, steps) -> np.ndarray:
    """(n,) number of the touch of samples: successive contours that come within a step of each
    other were tracked from one contact."""
    bounds = np.append(np.flatnonzero(np.diff(contours, prepend=-1)), len(contours))
    apart = [True]
    for a, b, c in zip(bounds[:-2], bounds[1:-1], bounds[2:], strict=True):
        square = cdist(points[a:b], points[b:c], "sqeuclidean")
        apart.append(bool(square.min() > max(steps[a], steps[b]) ** 2))
    return (np.cumsum(apart) - 1)[contours]


def _medians(values, groups, count: int) -> np.ndarray:
    """(count,) median of the values of each group. A group without any has that of the one before
    it that has some, or of the first: groups to come do not change it."""
    order = np.lexsort((values, groups))
    sizes = np.bincount(groups, minlength=count)
    known = np.flatnonzero(sizes)
    if not len(known):
        return np.zeros(count)
    middle = (np.cumsum(sizes) - sizes + sizes // 2)[known]
    last = np.searchsorted(known, np.arange(count), side="right") - 1
    return np.asarray(values[order][middle][np.maximum(last, 0)])


def plane_normals(points, planes, contours, std) -> np.ndarray:
    """(n, 3) unit normals within the sampling planes, of either sign from contour to contour, of
    samples with deviations (n,), length.

    Each is perpendicular to the tangent of a parabola through five samples. Of the window about
    the sample and those to either side the one that fits is taken, so that normals beside an edge
    are those of the sample's own side (essentially non-oscillatory, Harten and others, 1987).
    """
    count = len(points)
    first = np.searchsorted(contours, contours)
    last = np.searchsorted(contours, contours, side="right") - 1
    tangents, best = np.empty((count, 3)), np.full(count, np.inf)
    for back in (_WINDOW // 2, 0, _WINDOW - 1):
        start = np.clip(np.arange(count) - back, first, np.maximum(last - _WINDOW + 1, first))
        index = np.minimum(start[:, None] + np.arange(_WINDOW), last[:, None])
        tangent, residual = _parabola_tangents(points, index)
        # The centred window comes first: others must be much better.
        better = residual + (_MUCH_BETTER if back != _WINDOW // 2 else 0.0) * std**2 < best
        tangents[better], best[better] = tangent[better], residual[better]
    normals = cross(planes, tangents)
    length = np.sqrt((normals * normals).sum(axis=1))
    return normals / np.maximum(length, np.finfo(float).tiny)[:, None]


def _parabola_tangents(points, index) -> tuple[np.ndarray, np.ndarray]:
    """Tangents (n, 3), not unit, at each sample, and squared residuals (n,), length^2, of parabolas
    in the place along the chord, through samples index (n, w)."""
    window = points[index]
    chord = window[:, -1] - window[:, 0]
    span = np.maximum((chord * chord).sum(axis=1), np.finfo(float).tiny)
    s = ((window - points[:, None]) * chord[:, None]).sum(axis=2) / span[:, None]
    powers = np.stack([np.ones_like(s), s, s * s], axis=2)
    gram = powers.transpose(0, 2, 1) @ powers
    # Repeated samples of short contours make it singular.
    gram = gram + 1e-9 * np.eye(3)
    coefficients = np.linalg.solve(gram, powers.transpose(0, 2, 1) @ (window - points[:, None]))
    rest = window - points[:, None] - powers @ coefficients
    return coefficients[:, 1], (rest * rest).sum(axis=(1, 2))
