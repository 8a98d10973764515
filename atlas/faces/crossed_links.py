"""Links that pass over a face which stands in their way: over a slot, or through a rib."""

import numpy as np

from touchatlas.atlas.faces.labels import NONE, Labels

# Length of a link, in steps of its contour, from which it may pass over a face. Doubled, the tops
# beside a slot of two steps are one face.
_LONG = 2.5
# Samples about the middle of a link that may stand in its way. Doubled, nothing changes.
_BETWEEN = 32
# Distance of such a sample from where the link passes through its face, over the length of the
# link. Doubled, links that pass beside a rib are cut.
_BESIDE = 0.5
# Sine of the angle between a face and a link, from which it stands in the way: 30 degrees. Doubled,
# the tops beside a slot with slanting sides are linked.
_IN_THE_WAY = 0.5
# Distance of one end of a link from the piece of the other up to which both may be of one face, in
# standard deviations of a sample. Doubled, links over the rounding of an edge are cut.
_ONE = 4.0


def cut_crossed_links(labels: Labels) -> None:
    """Leave out the links between samples of one face, or of two that look like one, which pass
    through the face of a third label, beside a sample of it."""
    graph, samples = labels.evidence.graph, labels.evidence.samples
    first, second = graph.pairs.T
    way = samples.points[second] - samples.points[first]
    length = np.linalg.norm(way, axis=1)
    long = np.flatnonzero(length > _LONG * samples.steps[first])
    middle = samples.points[first[long]] + 0.5 * way[long]
    count = min(_BETWEEN, len(samples))
    away, near = graph.tree.query(middle, k=count)
    of, away = labels.of[near.reshape(-1, count)], away.reshape(-1, count)
    third = (of != NONE) & (away < length[long, None])
    third &= (of != labels.of[first[long], None]) & (of != labels.of[second[long], None])
    row, column = np.nonzero(third)
    link, between = long[row], near.reshape(-1, count)[row, column]
    normals, offset = (
        _normals(labels, between),
        samples.points[between] - samples.points[first[link]],
    )
    steep = (normals * way[link]).sum(axis=1)
    crosses = np.abs(steep) > _IN_THE_WAY * length[link]
    at = (normals * offset).sum(axis=1)[crosses] / steep[crosses]
    link, beside = link[crosses], offset[crosses] - at[:, None] * way[link[crosses]]
    crossed = (at > 0.0) & (at < 1.0)
    crossed &= np.linalg.norm(beside, axis=1) < _BESIDE * length[link]
    link = np.unique(link[crossed])
    labels.graph = graph.without(link[_look_like_one(labels, first[link], second[link])])


def _look_like_one(labels: Labels, first, second) -> np.ndarray:
    """(m,) whether samples (m,) lie on the pieces of others (m,)."""
    points, std = labels.evidence.samples.points, labels.evidence.samples.std
    off = np.full(len(first), np.inf)
    for label in np.unique(labels.of[first[labels.of[first] != NONE]]).tolist():
        mine = labels.of[first] == label
        off[mine] = np.abs(labels.pieces[label].at(points[second[mine]])[0])
    return off < _ONE * std


def _normals(labels: Labels, members) -> np.ndarray:
    """(m, 3) normals of the pieces of samples (m,), at these."""
    which, place = np.unique(members, return_inverse=True)
    out = np.empty((len(which), 3))
    for label in np.unique(labels.of[which]).tolist():
        mine = labels.of[which] == label
        out[mine] = labels.pieces[label].at(labels.evidence.samples.points[which[mine]])[1]
    return out[place]
