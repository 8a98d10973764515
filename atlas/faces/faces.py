"""Faces: parts of the surface bounded by edges and rims, as records."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.face_corners import FaceCorner
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.pieces.laws import Law
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.records.options import Levels
from touchatlas.patch.words import count_of

if TYPE_CHECKING:
    from networkx import MultiGraph


@dataclass(frozen=True, eq=False)
class Face:
    """A part of the surface bounded by sharp edges, smooth rims, and the end of what was touched.

    Parameters
    ----------
    id : int
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
    law: Law | None
    pieces: tuple[Piece, ...]
    patches: tuple[int, ...]
    samples: np.ndarray
    explained: float
    deviation: float
    middle: np.ndarray

    @property
    def kind(self) -> str:
        """That of its law: "plane", "sphere", "cylinder", "cone", "torus" or "quadric"; else
        "free-form"."""
        return self.law.kind if self.law else "free-form"

    @property
    def words(self) -> str:
        """Kind and numbers: "cylinder, radius 5.01 ± 0.01, axis (0.000, 0.000, 1.000)"."""
        if self.law:
            return self.law.words
        return self.kind + (f", {count_of(len(self.pieces), 'patch')}" if self.pieces else "")


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
        Standard deviation of the distance of the surest samples from their face.
    stds : (n,) float, length
        That of each sample.
    corners : tuple of FaceCorner
        Corners of three faces that are rounded with one ball.
    links : SampleGraph, optional
        Those of all samples.
    recall : Recall, optional
        What was found on the way, from which the next reading goes on.
    levels : Levels
        What is enough to decide; those of the samples.
    turns : (k, 2) int
        Where all is one free-form face: samples on both sides of the places at which contours run
        over a sharp edge.
    is_sharp : bool
        Whether so many contours do that the face has sharp edges there.
    tried : int
        Where all is one free-form face: number of the first samples with which radii of its sextics
        are tried.
    """

    faces: tuple[Face, ...]
    edges: tuple[FaceEdge, ...]
    points: np.ndarray
    normals: np.ndarray
    of: np.ndarray
    patch_of: np.ndarray
    rounded: np.ndarray
    std: float
    stds: np.ndarray
    corners: tuple[FaceCorner, ...] = ()
    links: SampleGraph | None = None
    recall: Recall | None = None
    levels: Levels = Levels()
    turns: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), int))
    is_sharp: bool = False
    tried: int = 0

    def __len__(self) -> int:
        return len(self.faces)

    def __repr__(self) -> str:
        """Their numbers alone: arrays of all samples would fill pages."""
        faces, edges = count_of(len(self.faces), "face"), count_of(len(self.edges), "edge")
        of_samples = f"{self.unexplained:.1%} of {len(self.of)} samples unexplained"
        return f"<Faces: {faces}, {edges}, {of_samples}>"

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

    def graph(self) -> "MultiGraph":
        """The faces as nodes and their edges as edges, with numbers and words only: see
        ``touchatlas.atlas.faces.face_graph``."""
        from touchatlas.atlas.faces.face_graph import as_networkx

        return as_networkx(self)

    def table(self) -> list[dict[str, float | str]]:
        """A row for each face, with the numbers and words of the nodes of ``graph``; for
        ``pandas.DataFrame``, or to be printed."""
        return [{"face": face} | numbers for face, numbers in self.graph().nodes(data=True)]
