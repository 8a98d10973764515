"""Links that pass over a face which stands in their way: over a slot, or through a rib."""

import numpy as np

from touchatlas.atlas.labels.labels import NONE, Labels

# Distance of a sample in the way of a link from where the link passes through its face, over the
# length of the link. Doubled, links that pass beside a rib are cut.
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
    graph, points = labels.evidence.graph, labels.evidence.samples.points
    first, second = graph.pairs.T
    way = points[second] - points[first]
    length = np.linalg.norm(way, axis=1)
    links, near = graph.long_links
    of = np.append(labels.of, NONE)[near]
    third = (of != NONE) & (of != labels.of[first[links], None])
    row, column = np.nonzero(third & (of != labels.of[second[links], None]))
    link, between = links[row], near[row, column]
    normals = _normals(labels, between)
    offset = points[between] - points[first[link]]
    steep = (normals * way[link]).sum(axis=1)
    crosses = np.abs(steep) > _IN_THE_WAY * length[link]
    at = (normals * offset).sum(axis=1)[crosses] / steep[crosses]
    link, beside = link[crosses], offset[crosses] - at[:, None] * way[link[crosses]]
    crossed = (at > 0.0) & (at < 1.0)
    crossed &= np.linalg.norm(beside, axis=1) < _BESIDE * length[link]
    link = np.unique(link[crossed])
    link = link[_look_like_one(labels, first[link], second[link])]
    if not np.array_equal(link, labels.cut):
        labels.cut, labels.graph = link, graph.without(link)


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
