"""Pairs of labels that may meet: linked across, or where contours end."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.labels import NONE, Labels


def pairs_across_links(labels: Labels) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to the middles (m, 3) of the links between their samples."""
    graph, points = labels.graph, labels.evidence.samples.points
    both = np.sort(labels.of[graph.pairs], axis=1)
    apart = np.flatnonzero((both[:, 0] != both[:, 1]) & (both[:, 0] != NONE))
    return _by_pair(both[apart], points[graph.pairs[apart]].mean(axis=1))


def pairs_across_ends(
    labels: Labels, reach: float, farther: float
) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to the points (m, 3) half-way between an end of a contour of one and
    the nearest sample of the other, within ``reach``, or within ``farther`` where the end lies on
    the piece of the other, to a step of its contour; length."""
    samples, of = labels.evidence.samples, labels.of
    new = np.diff(samples.contours, prepend=-1, append=samples.contours[-1] + 1) > 0
    ends = np.flatnonzero(new[:-1] | new[1:])
    ends = ends[of[ends] != NONE]
    if not len(ends):
        return {}
    found = []
    for label, members in enumerate(labels.all_members()):
        others = ends[of[ends] != label]
        tree = cKDTree(samples.points[members])
        length, nearest = tree.query(samples.points[others], distance_upper_bound=farther)
        there = nearest < len(members)
        found.append((others[there], members[nearest[there]], length[there]))
    i, j, length = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(i, kind="stable")
    i, j, length = i[order], j[order], length[order]
    good = length <= reach
    for label in np.unique(of[j[~good]]).tolist():
        mine = np.flatnonzero(~good & (of[j] == label))
        off = np.abs(labels.pieces[label].at(samples.points[i[mine]])[0])
        good[mine] = off <= samples.steps[i[mine]]
    i, j = i[good], j[good]
    both = np.sort(np.stack([of[i], of[j]], axis=1), axis=1)
    return _by_pair(both, 0.5 * (samples.points[i] + samples.points[j]))


def _by_pair(both, middles) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to those of middles (m, 3) that are between labels ``both`` (m, 2),
    the lower first."""
    order = np.lexsort((both[:, 1], both[:, 0]))
    both, middles = both[order], middles[order]
    new = np.flatnonzero((np.diff(both, axis=0, prepend=-1) != 0).any(axis=1))
    parts = np.split(middles, new)[1:]
    return {(int(a), int(b)): part for (a, b), part in zip(both[new], parts, strict=True)}
