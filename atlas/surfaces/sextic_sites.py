"""Where the sextics of a radius are: their middles, the samples that each follows, and axes."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.patch.geometry.arrays import cross, evenly, first_largest
from touchatlas.patch.geometry.frame import any_tangent

# Least cosine of the normal of a sample and of a sextic that follows it, and that weighs where it
# is nearest: 78 degrees, so that sextics reach over sharp bends.
FACING = 0.2
# Least distance of the middles of two sextics that face alike, in radii.
_APART = 0.4


@dataclass(frozen=True, eq=False)
class SexticSites:
    """Where sextics are.

    Parameters
    ----------
    radius : float, length
    middles : (m,) int
        Samples.
    axes : (m, 3, 3) float, unit rows, world
        The third is the mean normal of the samples within the radius that face as the middle does,
        the first points to the farthest: they turn as these do.
    members : list of (k,) int
        Samples, ascending, by which each sextic is fitted: those, or some of them.
    """

    radius: float
    middles: np.ndarray
    axes: np.ndarray
    members: list[np.ndarray]

    def some(self, index) -> "SexticSites":
        """Some of them."""
        members = [self.members[k] for k in index]
        return SexticSites(self.radius, self.middles[index], self.axes[index], members)


def sites_of(tree: cKDTree, normals, middles, radius: float) -> SexticSites:
    """Sextics of a radius with middles (m,) of samples with normals (n, 3). Many are found in
    blocks, for the memory that pairs of middles and samples take."""
    parts = [
        _in_block(tree, normals, middles[start : start + 128], radius)
        for start in range(0, len(middles), 128)
    ]
    axes, members = zip(*parts, strict=True)
    return SexticSites(radius, middles, np.concatenate(axes), sum(members, []))


def _in_block(tree: cKDTree, normals, middles, radius: float) -> tuple[np.ndarray, list]:
    """Axes (m, 3, 3) and members of some of the sextics."""
    owner, samples, away = pairs_within(cKDTree(tree.data[middles]), tree, radius)
    middle, own = middles.take(owner), normals.take(samples, axis=0)
    faces = np.einsum("ij,ij->i", own, normals.take(middle, axis=0)) > FACING
    # A middle of a normal of length zero faces itself.
    faces |= samples == middle
    owner, samples, away = owner[faces], samples[faces], away[faces]
    first = np.searchsorted(owner, np.arange(len(middles)))
    # More take longer, and change little.
    members = [evenly(some, 400) for some in np.split(samples, first[1:])]
    farthest = samples[first_largest(away, first)]
    tangents = tree.data[farthest] - tree.data[middles]
    return _axes(np.add.reduceat(own[faces], first), tangents), members


def pairs_within(points: cKDTree, others: cKDTree, radius: float) -> tuple[np.ndarray, ...]:
    """Points (k,) of one tree and of another one that are no farther from each other than a radius,
    in the order of the first, then of the second; and how far (k,) they are."""
    found = points.sparse_distance_matrix(others, radius, output_type="ndarray")
    order = np.argsort(found["i"] * others.n + found["j"])
    return found["i"].take(order), found["j"].take(order), found["v"].take(order)


def middles_of(tree: cKDTree, normals, radius: float, facing: float) -> np.ndarray:
    """(m,) samples in turn, each apart from the ones before or turned from them by an angle whose
    cosine is ``facing``: middles of sextics of a radius."""
    left, out = np.ones(tree.n, bool), []
    for sample in range(tree.n):
        if left[sample]:
            near = np.array(tree.query_ball_point(tree.data[sample], _APART * radius))
            left[near[normals[near] @ normals[sample] > facing]] = False
            out.append(sample)
    return np.array(out)


def _axes(normals, tangents) -> np.ndarray:
    """(m, 3, 3) axes along normals (m, 3) of any length, the first towards tangents (m, 3)."""
    normals = normals / np.sqrt((normals * normals).sum(axis=1))[:, None]
    across = tangents - (tangents * normals).sum(axis=1)[:, None] * normals
    square = (across * across).sum(axis=1)
    for k in np.flatnonzero(~(square > 1e-6 * (tangents * tangents).sum(axis=1))).tolist():
        across[k], square[k] = any_tangent(normals[k]), 1.0
    across /= np.sqrt(square)[:, None]
    return np.stack([across, cross(normals, across), normals], axis=1)
