"""Faces: pieces joined where nothing but the reach of one polynomial lies between them."""

from dataclasses import dataclass, field
from functools import cached_property

import networkx as nx
import numpy as np

from touchatlas.atlas.edges.blunt_edges import BluntEdge
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.faces.face_corners import FaceCorner, find_corners
from touchatlas.atlas.faces.polylines import polylines
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.pieces.laws import Law, law_of
from touchatlas.atlas.pieces.piece import Piece

# Least distance of the points of an edge, and longest gap in it, in steps of the contours. Doubled,
# edges are coarser, and bridge wider gaps between touches.
_SPACING, _LONGEST_GAP = 0.5, 8.0


@dataclass(frozen=True, eq=False)
class Face:
    """A part of the surface bounded by sharp edges, smooth rims, and the end of what was touched.

    Parameters
    ----------
    id : int
    words : str
        Kind and numbers: "cylinder, radius 5.01 ± 0.01, axis (0.000, 0.000, 1.000)".
    kind : str
        "plane", "sphere", "cylinder", "quadric" or "free-form".
    law : Law or None
        Numbers of a lawful face; None for a free-form one.
    pieces : tuple of Piece
        One for a lawful face.
    patches : tuple of int
        Numbers of the pieces among all, as in ``Faces.patch_of``; no ids of patches of the atlas.
    samples : (m,) int
        Indices of its samples, ascending.
    explained : float
        Fraction of the samples within three standard deviations of their piece.
    deviation : float, length
        Root mean square of the distances of the samples from their pieces.
    middle : (3,) float, length, world
        The sample nearest to the mean of all.
    """

    id: int
    words: str
    kind: str
    law: Law | None
    pieces: tuple[Piece, ...]
    patches: tuple[int, ...]
    samples: np.ndarray
    explained: float
    deviation: float
    middle: np.ndarray


@dataclass(frozen=True, eq=False)
class FaceEdge:
    """Where two faces meet in one way.

    Parameters
    ----------
    first, second : int
        Ids of the faces, the lower first.
    kind : EdgeKind
    curves : tuple of (k, 3) float, length, world
        Points in order, where contours crossed the edge; the last is the first where a curve is
        closed.
    length : float, length
        Of all curves: less than that of the edge, whose ends no contour crossed.
    deviation : float, length
        Median standard deviation of a point's distance from the true curve, as predicted.
    angle : float, rad
        Median angle between the normals of both faces; about zero at a smooth rim.
    gap : float, length
        Root mean square of how far the two surfaces are apart there.
    radius, radius_std : float, length
        Radius of the ball that rounds a sharp edge, 0 where none does, and its standard deviation.
    samples : (m,) int
        Samples of no face that lie on its rounding, ascending.
    """

    first: int
    second: int
    kind: EdgeKind
    curves: tuple[np.ndarray, ...]
    length: float
    deviation: float
    angle: float
    gap: float
    radius: float = 0.0
    radius_std: float = 0.0
    samples: np.ndarray = field(default_factory=lambda: np.zeros(0, int))


@dataclass(frozen=True, eq=False, repr=False)
class Faces:
    """The faces of what was touched, and their edges.

    Parameters
    ----------
    faces : tuple of Face
        The id of a face is its place.
    edges : tuple of FaceEdge
    points, normals : (n, 3) float, length; unit, world
        All samples, and outward normals by their pieces.
    of : (n,) int
        Id of the face of each sample, -1 where nothing explains it.
    patch_of : (n,) int
        Number of the piece of each sample, -1 where there is none.
    rounded : (k,) int
        Samples of no face that lie on rounded edges or corners, ascending.
    std : float, length
        Standard deviation of a sample's distance from its face.
    corners : tuple of FaceCorner
        Corners of three faces that are rounded with one ball.
    links : SampleGraph, optional
        Those of all samples, from which the next reading goes on.
    recall : Recall, optional
        What was found on the way, likewise.
    turns : (k, 2) int
        Where all is one free-form face: samples on both sides of the places at which contours run
        over a sharp edge.
    is_sharp : bool
        Whether so many contours do that the face has sharp edges there.
    """

    faces: tuple[Face, ...]
    edges: tuple[FaceEdge, ...]
    points: np.ndarray
    normals: np.ndarray
    of: np.ndarray
    patch_of: np.ndarray
    rounded: np.ndarray
    std: float
    corners: tuple[FaceCorner, ...] = ()
    links: SampleGraph | None = None
    recall: Recall | None = None
    turns: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), int))
    is_sharp: bool = False

    def __len__(self) -> int:
        return len(self.faces)

    def __repr__(self) -> str:
        """Their numbers alone: arrays of all samples would fill pages."""
        faces, edges = len(self.faces), len(self.edges)
        of_samples = f"{self.unexplained:.1%} of {len(self.of)} samples unexplained"
        return f"<Faces: {faces} faces, {edges} edges, {of_samples}>"

    @cached_property
    def unexplained(self) -> float:
        """Fraction of the samples that belong to no face and no rounded edge or corner; 0 without
        samples."""
        if not len(self.of):
            return 0.0
        return (np.count_nonzero(self.of == NONE) - len(self.rounded)) / len(self.of)

    @property
    def are_lawful(self) -> bool:
        """Whether all faces obey laws."""
        return all(face.law is not None for face in self.faces)

    @property
    def pieces(self) -> list[Piece]:
        """All pieces, by their numbers."""
        found = {k: p for f in self.faces for k, p in zip(f.patches, f.pieces, strict=True)}
        return [found[k] for k in sorted(found)]

    def graph(self) -> nx.MultiGraph:
        """The faces as nodes and their edges as edges, with numbers and words only: see
        ``touchatlas.atlas.faces.face_graph``."""
        from touchatlas.atlas.faces.face_graph import as_networkx

        return as_networkx(self)


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
    points, normals = _frozen(samples.points), _frozen(_normals(labels))
    corners = find_corners(tuple(faces), edges, points, np.flatnonzero(of == NONE), samples.std)
    balls = [edge.samples for edge in edges] + [corner.samples for corner in corners]
    rounded = np.unique(np.concatenate([np.zeros(0, int), *balls]))
    own = of, labels.of.copy(), rounded, samples.std, corners
    kept = labels.evidence.graph, labels.evidence.recall
    return Faces(tuple(faces), edges, points, normals, *own, *kept)


def _frozen(array) -> np.ndarray:
    """A copy that cannot be changed."""
    out = np.array(array)
    out.flags.writeable = False
    return out


def _normals(labels: Labels) -> np.ndarray:
    """(n, 3) normals of the samples by their pieces, or estimates where they have none."""
    samples = labels.evidence.samples
    out = samples.outward.copy()
    for piece, members in zip(labels.pieces, labels.all_members(), strict=True):
        out[members] = piece.at(samples.points[members])[1]
    return out


def _groups(labels: Labels, boundaries: list[Boundary]) -> np.ndarray:
    """(p,) number of the face of each of p labels."""
    graph, samples = nx.Graph(), labels.evidence.samples
    graph.add_nodes_from(range(len(labels.pieces)))
    sure = [samples.are_of_several_contours(members) for members in labels.all_members()]
    artificial = [(b.first, b.second) for b in boundaries if b.kind is EdgeKind.ARTIFICIAL]
    graph.add_edges_from(pair for pair in artificial if all(sure[k] for k in pair))
    group = np.zeros(len(sure), int)
    for number, part in enumerate(nx.connected_components(graph)):
        group[list(part)] = number
    return group


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
        law = law_of(pieces[0], samples.points[members], samples.std)
    kind = pieces[0].kind.name.lower() if law else "free-form"
    patches = f"{len(pieces)} patch" + ("" if len(pieces) == 1 else "es")
    offset = samples.points[members] - samples.points[members].mean(axis=0)
    return Face(
        number,
        law.words if law else f"free-form, {patches}",
        kind,
        law,
        pieces,
        tuple(own.tolist()),
        members,
        float((np.abs(distance) <= 3.0 * samples.std).mean()),
        float(np.sqrt((distance * distance).mean())),
        samples.points[members[(offset * offset).sum(axis=1).argmin()]],
    )


def _edges(labels: Labels, boundaries: list[Boundary], face_of_label) -> tuple[FaceEdge, ...]:
    """The edges between faces: one for each pair and kind."""
    groups: dict[tuple[int, int, str], list[Boundary]] = {}
    for b in boundaries:
        low, high = sorted((int(face_of_label[b.first]), int(face_of_label[b.second])))
        if low != high:
            groups.setdefault((low, high, b.kind.value), []).append(b)
    step = float(np.median(labels.evidence.samples.steps))
    return tuple(face_edge(*key[:2], parts, step) for key, parts in sorted(groups.items()))


def face_edge(first: int, second: int, parts: list[Boundary], step: float) -> FaceEdge:
    """One edge from the boundaries between the pieces of two faces; ``step`` is that of contours,
    length."""
    points = np.concatenate([b.curve.points for b in parts])
    deviation = np.concatenate([b.curve.deviation for b in parts])
    lines = polylines(points, deviation, _SPACING * step, _LONGEST_GAP * step)
    curves = tuple(points[line] for line in lines)
    weights = np.array([len(b.curve.points) for b in parts], float)
    blunt = [b.blunt for b in parts if b.blunt is not None]
    return FaceEdge(
        first,
        second,
        parts[0].kind,
        curves,
        float(sum(np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in curves)),
        float(np.median(deviation)),
        float(np.average([b.angle for b in parts], weights=weights)),
        float(np.sqrt(np.average([b.gap**2 for b in parts], weights=weights))),
        *_radius(blunt),
        np.unique(np.concatenate([np.zeros(0, int), *(edge.samples for edge in blunt)])),
    )


def _radius(blunt: list[BluntEdge]) -> tuple[float, float]:
    """Mean radius of blunt edges by their variances, and its standard deviation; zeros of none."""
    if not blunt:
        return 0.0, 0.0
    weights = np.array([edge.deviation**-2 for edge in blunt])
    mean = np.average([edge.radius for edge in blunt], weights=weights)
    return float(mean), float(weights.sum() ** -0.5)
