"""The field of faces: signed distance, normal and deviation at any point, each face by its own."""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.field.cells import Cells
from touchatlas.atlas.field.edge_cuts import SharpEdges
from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees
from touchatlas.atlas.field.passed_air import PassedAir
from touchatlas.atlas.field.rounded_edges import RoundedEdges, face_of_each_sample
from touchatlas.atlas.field.sides import Sides
from touchatlas.atlas.field.smooth_rims import SmoothRims
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.surfaces.free_form import FreeFormSurface
from touchatlas.patch.geometry.arrays import box_diagonal, frozen_array

# Points of which the field is asked at once.
_AT_ONCE = 1 << 14


@dataclass(frozen=True, eq=False)
class FaceValues:
    """What the faces say of n points.

    Parameters
    ----------
    distance : (n,) float, length
        Signed, positive outside.
    normal : (n, 3) float, unit, world
        Outward.
    deviation : (n,) float, length
        Predicted standard deviation of the distance: that of the coefficients, and half of the
        difference of two faces where both may have the point; the distance itself where samples
        contradict it.
    face : (n,) int
        Id of the face that decides.
    """

    distance: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    face: np.ndarray

    def some(self, index) -> "FaceValues":
        """The same at some of the points."""
        return FaceValues(*(column[index] for column in vars(self).values()))


class FaceField:
    """The field of faces.

    Parameters
    ----------
    faces : Faces
    before : FaceTrees, optional
        See ``FaceTrees``.

    Attributes
    ----------
    is_one_face : bool
        Whether all samples are one face, so that there is no edge.
    reach : float, length
        Distance across which a face is believed where no sample is, and from its samples up to
        which it may bound another.
    air : PassedAir or None
        Where a probe passed through the faces.

    Raises
    ------
    ValueError
        Without a face.
    """

    def __init__(self, faces: Faces, before: FaceTrees | None = None) -> None:
        if not len(faces):
            raise ValueError("there is no face; add touches to the atlas first")
        self.faces = faces
        self.air: PassedAir | None = None
        self.trees = trees = FaceTrees(faces, before)
        self.reach = faces.levels.believed * box_diagonal(faces.points)
        self.is_one_face = len(faces) == 1
        if self.is_one_face:
            self.reach = trees.scale_of(0)
            return
        self._of = face_of_each_sample(trees)
        self._labelled = np.flatnonzero(self._of != NONE)
        self._tree = cKDTree(faces.points[self._labelled])
        self._sharp, self._rims = SharpEdges(trees, self.reach), SmoothRims(trees)
        self._cells = Cells(trees, self.reach, self._rims)
        self._rounded = RoundedEdges(trees, self.reach)

    def with_surface(self, surface: FreeFormSurface) -> "FaceField":
        """The same field, of one free-form face, with another surface of it."""
        found = copy(self)
        found.trees = self.trees.with_surface(surface)
        return found

    def with_air(self, air: PassedAir | None) -> "FaceField":
        """The same field, with other air that a probe passed."""
        found = copy(self)
        found.air = air
        return found

    @cached_property
    def meet(self) -> np.ndarray:
        """(f, f) whether two faces have an edge or rim in common, or are one."""
        out = np.eye(len(self.faces), dtype=bool)
        for edge in self.faces.edges:
            out[edge.first, edge.second] = out[edge.second, edge.first] = True
        return out

    @property
    def same_surface(self) -> np.ndarray:
        """(f,) the first face that is one surface with each face."""
        return np.zeros(1, int) if self.is_one_face else self._cells.same_surface

    def at(self, points) -> FaceValues:
        """Signed distance, normal, deviation and face at points (n, 3), length, world.

        Where samples show on which side of the surface a point lies, and that the nearest face is
        its surface, that face decides. Elsewhere it is the face of the nearest sample, with those
        that bound it. Rounded edges come last, and then the air that a probe passed.
        """
        points = np.asarray(points, float)
        found = self._of_faces(points)
        if self.air is None:
            return found
        return replace(
            found, **self.air.moved(points, found.distance, found.normal, found.deviation)
        )

    def level(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and normal (n, 3) at points (n, 3), as of ``at``: those of one face
        take less time without the deviation."""
        if not self.is_one_face:
            found = self.at(points)
            return found.distance, found.normal
        one = np.concatenate([self.trees.of(0).level(some) for some in _blocks(points)])
        if self.air is None:
            return one[:, 0], one[:, 1:]
        moved = self.air.moved(points, one[:, 0], one[:, 1:], np.zeros(len(one)))
        return moved["distance"], moved["normal"]

    def _of_faces(self, points) -> FaceValues:
        """The same of the faces alone."""
        parts = [vars(self._of_block(some)).values() for some in _blocks(points)]
        return FaceValues(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _of_block(self, points) -> FaceValues:
        """The same of points that come at once."""
        if self.is_one_face:
            one, face = self.trees.of(0).values(points), np.zeros(len(points), int)
            return FaceValues(one[:, 0], one[:, 1:4], np.sqrt(one[:, 4]), face)
        at = self.trees.at(points)
        sides = self._cells.sides(at)
        decides, chosen = self._cells.decide(at, sides)
        owner, rows = decides.copy(), np.flatnonzero(decides < 0)
        if len(rows):
            found = self._by_samples(at.some(rows), sides.some(rows))
            owner[rows], decides[rows], chosen[rows] = found
        self._rounded.round(at, owner, decides, chosen)
        normal = chosen[:, 1:4] / np.linalg.norm(chosen[:, 1:4], axis=1)[:, None]
        return FaceValues(chosen[:, 0], normal, np.sqrt(chosen[:, 4]), decides)

    def _by_samples(self, at: FacesAt, sides: Sides) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The face (n,) of the sample nearest to each of n points, the face (n,) that decides, and
        its distance, normal and variance (n, 5).

        At a sharp edge the distance is the largest of those of the faces that meet there in
        a convex edge, the smallest in a concave one.
        """
        count = min(16, len(self._labelled))
        away, near = self._tree.query(at.points, k=count)
        away = away.reshape(len(at.points), count)
        near = self._labelled[near.reshape(len(at.points), count)]
        owner, chosen = self._of_walls(at, away, self._of[near])
        self._rims.move(at, away, owner, chosen)
        decides = self._sharp.cut(at, away, owner, chosen)
        doubted = self._cells.settle(at, sides, away[:, 0], owner, decides, chosen)
        chosen[doubted, 4] = np.maximum(chosen[doubted, 4], chosen[doubted, 0] ** 2)
        return owner, decides, chosen

    def _of_walls(self, at: FacesAt, away, of) -> tuple[np.ndarray, np.ndarray]:
        """The face (n,) of the nearest sample, or the nearer one of two that face away from each
        other, as the sides of a wall or a gap do, where its sample is less than twice as far: on a
        thin wall the nearest sample of a place between touches is of the other side. And its
        distance, normal and variance (n, 5).

        Parameters
        ----------
        at : FacesAt
            Of n points.
        away : (n, k) float, length
            Distances of the nearest samples, ascending.
        of : (n, k) int
            Their faces.
        """
        values, owner = _values_near(at, of), of[:, 0].copy()
        own = values[owner, np.arange(len(of))]
        off = np.abs(np.take_along_axis(at.distances, of, axis=1))
        near = (away < 2.0 * away[:, :1]) & (off < np.abs(own[:, :1])) & (of != of[:, :1])
        for column in np.flatnonzero(near.any(axis=0)).tolist():
            rows = np.flatnonzero(near[:, column] & (off[:, column] < np.abs(own[:, 0])))
            other = values[of[rows, column], rows]
            turned = (other[:, 1:4] * own[rows, 1:4]).sum(axis=1) < -self.faces.levels.facing
            rows = rows[turned]
            owner[rows], own[rows] = of[rows, column], other[turned]
        return owner, own


def face_values(faces: Faces, points) -> FaceValues:
    """Signed distance, normal, deviation and face at points (n, 3): see ``FaceField.at``.

    Raises
    ------
    ValueError
        When the arguments are no Faces and no finite points, or there is no face.
    """
    if not isinstance(faces, Faces):
        raise ValueError(f"got {type(faces).__name__}; give the Faces that Atlas.faces() returns")
    return FaceField(faces).at(frozen_array(points, (None, 3), "points"))


def _blocks(points) -> list[np.ndarray]:
    """Points (n, 3) in blocks, for the memory that all sextics and faces about them take."""
    starts = range(0, max(len(points), 1), _AT_ONCE)
    return [points[start : start + _AT_ONCE] for start in starts]


def _values_near(at: FacesAt, of) -> np.ndarray:
    """(f, n, 5) distance, normal and variance of all faces at n points, where these are of samples
    near the point, ``of`` (n, k); elsewhere nothing is set."""
    out = np.empty((at.distances.shape[1], len(of), 5))
    for face in np.flatnonzero(np.bincount(of.ravel())).tolist():
        rows = np.flatnonzero((of == face).any(axis=1))
        out[face, rows] = at.values(face, rows)
    return out
