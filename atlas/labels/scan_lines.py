"""Scan line grouping (X. Jiang, H. Bunke, "Fast segmentation of range images into planar regions by
scan line grouping", Machine Vision and Applications, 1994): planes begin with straight runs."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.patch.geometry.kinks import SIDE

# Least number of samples of a straight run: two are always straight.
_LEAST = 3
# Runs of other contours that each run is paired with, the nearest ones.
_PAIRED = 6


def pairs_of_runs(samples: ContourSamples, left) -> list[np.ndarray]:
    """Pairs of straight runs of two contours near each other, as samples (m,), ascending: two that
    lie on a plane determine it. Asked are contours of few samples, where those that are next to
    each other may be of two sides.

    Parameters
    ----------
    samples : ContourSamples
    left : (n,) bool
        Samples that may be in a run.
    """
    runs = [run for some in _contours(samples, left) for run in straight_runs(samples, some)]
    if len(runs) < 2:
        return []
    middles = np.array([samples.points[run].mean(axis=0) for run in runs])
    contours = np.array([samples.contours[run[0]] for run in runs])
    near = cKDTree(middles).query(middles, k=min(_PAIRED + 1, len(runs)))[1]
    pairs = {
        (min(k, other), max(k, other))
        for k, others in enumerate(near.tolist())
        for other in others
        if contours[k] != contours[other]
    }
    return [np.sort(np.concatenate([runs[a], runs[b]])) for a, b in sorted(pairs)]


def straight_runs(samples: ContourSamples, some) -> list[np.ndarray]:
    """The straight runs of consecutive samples ``some`` (k,) of one contour, each of three or more.
    They are split at the sample that is farthest from the line through their ends (U. Ramer, 1972;
    D. H. Douglas, T. K. Peucker, 1973), which is of neither part, until all are as near to it as
    noise explains."""
    if len(some) < _LEAST:
        return []
    points = samples.points[some] - samples.points[some[0]]
    along = points[-1] / max(float(np.linalg.norm(points[-1])), np.finfo(float).tiny)
    off = np.linalg.norm(points - (points @ along)[:, None] * along, axis=1) / samples.stds[some]
    worst = int(off.argmax())
    # Half-way between two ends their line has half of the variance of a sample.
    if off[worst] <= samples.levels.sure * np.sqrt(1.5):
        return [some]
    parts = some[:worst], some[worst + 1 :]
    return [run for part in parts for run in straight_runs(samples, part)]


def _contours(samples: ContourSamples, left) -> Iterator[np.ndarray]:
    """Consecutive samples (k,) that are left, contour by contour, of those that are too short to
    show where they run over an edge; those of no curve are not."""
    short = np.bincount(samples.contours)[samples.contours] <= 2 * SIDE
    some = np.flatnonzero(left & short & samples.planes.any(axis=1))
    breaks = (np.diff(some) > 1) | (np.diff(samples.contours[some]) != 0)
    yield from np.split(some, np.flatnonzero(breaks) + 1)
