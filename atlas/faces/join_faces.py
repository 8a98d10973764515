"""Join faces: pieces are joined where nothing but the reach of one polynomial lies between them."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.edges.blunt_edges import BluntEdge
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.faces.face_corners import find_corners
from touchatlas.atlas.faces.faces import Face, FaceEdge, Faces
from touchatlas.atlas.faces.polylines import polylines
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.laws import law_of
from touchatlas.atlas.records.options import Levels
from touchatlas.patch.geometry.arrays import frozen_array, nearest_to_mean


def join_faces(labels: Labels, boundaries: list[Boundary]) -> Faces:
    """Faces of a labelling, the largest first, and the edges between them.

    Pieces with an artificial boundary between them are of one face, but one that a single contour
    met: it may be of any.
    """
    group = _groups(labels, boundaries)
    sizes = np.bincount(group, [len(m) for m in labels.all_members()])
    rank = np.argsort(np.argsort(-sizes, kind="stable"), kind="stable")
    face_of_label = rank[group]
    of = np.where(labels.of == NONE, NONE, face_of_label[labels.of])
    faces = [_face(labels, k, np.flatnonzero(face_of_label == k), of) for k in range(len(sizes))]
    edges = _edges(labels, boundaries, face_of_label)
    samples = labels.evidence.samples
    points = frozen_array(samples.points, (None, 3), "points")
    normals = frozen_array(_normals(labels), (None, 3), "normals")
    loose, sure = np.flatnonzero(of == NONE), samples.levels.sure
    corners = find_corners(tuple(faces), edges, points, loose, samples.std, sure)
    balls = [edge.samples for edge in edges] + [corner.samples for corner in corners]
    on_balls = np.flatnonzero(labels.rounded & (labels.of == NONE))
    rounded = np.unique(np.concatenate([on_balls, *balls]))
    own = of, labels.of.copy(), rounded, samples.std, samples.stds, corners
    kept = labels.evidence.graph, labels.evidence.recall, samples.levels
    return Faces(tuple(faces), edges, points, normals, *own, *kept)


def _normals(labels: Labels) -> np.ndarray:
    """(n, 3) normals of the samples by their pieces, or estimates where they have none."""
    samples = labels.evidence.samples
    out = samples.outward.copy()
    for piece, members in zip(labels.pieces, labels.all_members(), strict=True):
        out[members] = piece.at(samples.points[members])[1]
    return out


def _groups(labels: Labels, boundaries: list[Boundary]) -> np.ndarray:
    """(p,) number of the face of each of p labels."""
    samples = labels.evidence.samples
    sure = [samples.are_of_several_contours(members) for members in labels.all_members()]
    artificial = [(b.first, b.second) for b in boundaries if b.kind is EdgeKind.ARTIFICIAL]
    return linked(len(sure), [pair for pair in artificial if all(sure[k] for k in pair)])


def _face(labels: Labels, number: int, own, of) -> Face:
    """The face of a number with its own labels."""
    samples, pieces = labels.evidence.samples, tuple(labels.pieces[k] for k in own)
    members = np.flatnonzero(of == number)
    distance = np.empty(len(members))
    for k in own:
        mine = labels.of[members] == k
        distance[mine] = labels.pieces[k].at(samples.points[members[mine]])[0]
    law = None
    if len(pieces) == 1 and pieces[0].kind.lawful:
        law = law_of(pieces[0], samples.points[members], samples.stds[members])
    return Face(
        number,
        law,
        pieces,
        tuple(own.tolist()),
        members,
        float((np.abs(distance) <= 3.0 * samples.stds[members]).mean()),
        float(np.sqrt((distance * distance).mean())),
        nearest_to_mean(samples.points[members]),
    )


def _edges(labels: Labels, boundaries: list[Boundary], face_of_label) -> tuple[FaceEdge, ...]:
    """The edges between faces: one for each pair and kind."""
    groups: dict[tuple[int, int, str], list[Boundary]] = {}
    for b in boundaries:
        low, high = sorted((int(face_of_label[b.first]), int(face_of_label[b.second])))
        if low != high:
            groups.setdefault((low, high, b.kind.value), []).append(b)
    samples = labels.evidence.samples
    own = float(np.median(samples.steps)), samples.tip, samples.levels.sure
    return tuple(face_edge(*key[:2], parts, *own) for key, parts in sorted(groups.items()))


def face_edge(
    first: int,
    second: int,
    parts: list[Boundary],
    step: float,
    tip: float = 0.0,
    sure: float = Levels.sure,
) -> FaceEdge:
    """One edge from the boundaries between the pieces of two faces; ``step`` is that of contours,
    length. Its points are half a step apart at least, and no gap in it is longer than 8 steps. A
    convex edge of the centres of a ``tip`` (length) is rounded by it at least, and by no more where
    its radius is not ``sure`` deviations off."""
    points = np.concatenate([b.curve.points for b in parts])
    deviation = np.concatenate([b.curve.deviation for b in parts])
    lines = polylines(points, deviation, 0.5 * step, 8.0 * step)
    curves = tuple(points[line] for line in lines)
    weights = np.array([len(b.curve.points) for b in parts], float)
    blunt, kind = [b.blunt for b in parts if b.blunt is not None], parts[0].kind
    return FaceEdge(
        first,
        second,
        kind,
        curves,
        float(sum(np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in curves)),
        float(np.median(deviation)),
        float(np.average([b.angle for b in parts], weights=weights)),
        float(np.sqrt(np.average([b.gap**2 for b in parts], weights=weights))),
        *_radius(blunt, tip if kind is EdgeKind.SHARP_CONVEX else 0.0, sure),
        np.unique(np.concatenate([np.zeros(0, int), *(edge.samples for edge in blunt)])),
    )


def _radius(blunt: list[BluntEdge], least: float, sure: float) -> tuple[float, float]:
    """Mean radius of blunt edges by their variances, and its standard deviation; the least radius,
    which is known, of none, and where the mean is not ``sure`` deviations off it."""
    if not blunt:
        return least, 0.0
    weights = np.array([edge.deviation**-2 for edge in blunt])
    mean = np.average([edge.radius for edge in blunt], weights=weights)
    deviation = float(weights.sum() ** -0.5)
    if least and abs(mean - least) <= sure * deviation:
        return least, 0.0
    return float(mean), deviation


def linked(count: int, pairs) -> np.ndarray:
    """(count,) numbers of the groups of so many things of which pairs belong together; the group
    of the first thing is 0, the next one 1.

    >>> linked(5, [(3, 1), (4, 3)]).tolist()
    [0, 1, 2, 1, 1]
    """
    first, second = np.reshape(pairs, (-1, 2)).astype(int).T
    graph = coo_array((np.ones(len(first)), (first, second)), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])
