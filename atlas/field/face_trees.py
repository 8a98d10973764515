"""FaceTrees: the samples of each face by place, and what each face says of points."""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.faces import Face, FaceEdge, Faces
from touchatlas.atlas.faces.join_faces import linked
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.surfaces.fit_free_form import are_on, fit_free_form
from touchatlas.atlas.surfaces.free_form import FreeFormSurface
from touchatlas.atlas.surfaces.sextic_mean import Mean
from touchatlas.patch.geometry.arrays import box_diagonal


class FaceTrees:
    """The samples of each face by place.

    Parameters
    ----------
    faces : Faces
    before : FaceTrees, optional
        Those of the first of the samples: where both are one face, what did not change is not
        fitted again. The result is the same without it.
    """

    def __init__(self, faces: Faces, before: "FaceTrees | None" = None) -> None:
        # The surface of the first of the samples, where all are one face.
        self._before = before._surfaces.get((0,)) if before and len(faces) == 1 else None
        self.faces = faces
        self.radius = 0.25 * box_diagonal(faces.points)
        self._surfaces: dict[tuple[int, ...], FreeFormSurface] = {}
        # Samples of several faces: the face of each, and their tree.
        self._together: dict[tuple[int, ...], tuple[np.ndarray, cKDTree]] = {}
        self.trees = [cKDTree(faces.points[face.samples]) for face in faces.faces]
        # A face is believed no farther from its samples than these are from each other.
        self.extents = np.array([np.linalg.norm(tree.maxes - tree.mins) for tree in self.trees])

    def away(self, number: int, points, limit: float = np.inf) -> np.ndarray:
        """(n,) distances of points (n, 3) from the samples of a face, length; infinite from a limit
        on."""
        return np.asarray(self.trees[number].query(points, distance_upper_bound=limit)[0])

    def nearest_of(self, numbers: tuple[int, ...], points) -> np.ndarray:
        """(n,) which of some faces has the sample nearest to points (n, 3)."""
        if numbers not in self._together:
            of = np.repeat(numbers, [self.trees[k].n for k in numbers])
            data = np.concatenate([self.trees[k].data for k in numbers])
            self._together[numbers] = of, cKDTree(data)
        of, tree = self._together[numbers]
        return np.asarray(of[tree.query(points)[1]])

    def nearest(self, number: int, points, count: int) -> tuple[np.ndarray, np.ndarray]:
        """(n, k) which samples of a face are nearest to points (n, 3), ``count`` or all, and how
        far they are, length."""
        count = min(count, len(self.faces.faces[number].samples))
        off, near = self.trees[number].query(points, k=count)
        return np.reshape(near, (len(points), count)), np.reshape(off, (len(points), count))

    @cached_property
    def between(self) -> list[np.ndarray]:
        """Of each face, the signed distances (m, f) of its samples from all faces, length."""
        return [self.all_distances(self.faces.points[face.samples]) for face in self.faces.faces]

    def of(self, number: int) -> Piece | FreeFormSurface:
        """What has the surface of a face: the piece of its law, or a free-form surface."""
        surface = self.free_form(number)
        return self.faces.faces[number].pieces[0] if surface is None else surface

    def alike(self, noise) -> tuple[np.ndarray, np.ndarray]:
        """(f,) the first face that is one surface with each, as parts of one plane are: most
        samples of the later one lie on it within the noise (f,), with its normal or the opposite
        one; and (f,) 1 or -1, for its normal."""
        faces = self.faces.faces
        one, way = np.arange(len(faces)), np.ones(len(faces))
        for later in range(len(faces)):
            some = slice(None, None, max(1, len(faces[later].samples) // 64))
            points = self.faces.points[faces[later].samples[some]]
            on = np.abs(self.between[later][some]) < noise + noise[later]
            for first in np.flatnonzero(on[:, :later].mean(axis=0) > 0.5).tolist():
                normals = [self.of(k).level(points)[:, 1:] for k in (first, later)]
                cosine = (normals[0] * normals[1]).sum(axis=1)
                if (on[:, first] & (np.abs(cosine) > 0.99)).mean() > 0.5:
                    one[later], way[later] = one[first], way[first] * np.sign(np.median(cosine))
                    break
        return one, way

    def all_distances(self, points) -> np.ndarray:
        """(n, f) signed distances of points (n, 3) from all faces."""
        return self.at(points).distances

    def at(self, points) -> "FacesAt":
        """What all faces say of points (n, 3): planes are asked at once, and a surface once for
        all faces that it has."""
        out, means = np.empty((len(points), len(self.faces))), {}
        middle, planes, normals, levels = self.planes
        out[:, planes] = (points - middle) @ normals.T + levels
        for group in self.groups:
            bent = [number for number in group if number not in planes]
            if bent and (surface := self.free_form(bent[0])) is not None:
                means[group[0]] = surface.mean_at(points)
                out[:, bent] = means[group[0]].values[:, :1]
            elif bent:
                out[:, bent] = self.of(bent[0]).distances(points)[:, None]
        return FacesAt(self, points, out, means)

    @cached_property
    def groups(self) -> list[tuple[int, ...]]:
        """The faces of each surface: a lawful face alone, and those that a free-form one has."""
        own = [(face.id,) for face in self.faces.faces if face.id not in self._group_of]
        return own + list(dict.fromkeys(self._group_of.values()))

    @cached_property
    def planes(self) -> tuple[np.ndarray, list[int], np.ndarray, np.ndarray]:
        """A point amid the samples (3,), the numbers (p) of the plane faces, their normals (p, 3)
        and signed distances (p,) there."""
        middle = self.faces.points.mean(axis=0)
        lawful = [face for face in self.faces.faces if face.law is not None]
        faces = [face for face in lawful if face.pieces[0].kind is Kind.PLANE]
        found = [face.pieces[0].at(middle[None]) for face in faces]
        normals = np.reshape([normal for _, normal in found], (-1, 3))
        return middle, [f.id for f in faces], normals, np.ravel([level for level, _ in found])

    def is_free_form(self, number: int) -> bool:
        """Whether a face obeys no law, or is a quadric or no larger than a quartic, and smooth rims
        join it to such a face: a part of a free-form surface that a law happens to explain."""
        return number in self._group_of

    def patches(self) -> list[tuple[int, Piece]]:
        """The pieces of lawful faces, and the sextics of free-form ones, each with the id of its
        face; of several faces with one surface that of the first."""
        own = [(f.id, f.pieces[0]) for f in self.faces.faces if f.id not in self._group_of]
        for first, surface in self._all_free_form.items():
            own += [(first, surface.sextics.piece(k)) for k in range(len(surface.sextics))]
        return own

    def patches_at(self, points, face) -> np.ndarray:
        """(n,) numbers, in this order, of the patches that weigh most at points (n, 3), each on the
        face (n,)."""
        out, firsts = np.empty(len(points), int), np.array([first for first, _ in self.patches()])
        for number in np.unique(face).tolist():
            mine, surface = face == number, self.free_form(number)
            out[mine] = np.flatnonzero(firsts == self.first_of(number))[0]
            if surface is not None:
                out[mine] += surface.leading(points[mine])
        return out

    @property
    def sample_counts(self) -> np.ndarray:
        """Number of the samples of each of the patches, in this order: those of a face, or those
        within the radius of a sextic."""
        own = [len(f.samples) for f in self.faces.faces if f.id not in self._group_of]
        surfaces = self._all_free_form.values()
        return np.concatenate([own, *(surface.sample_counts for surface in surfaces)]).astype(int)

    @property
    def patch_count(self) -> int:
        """Number of these."""
        sextics = sum(len(surface.sextics) for surface in self._all_free_form.values())
        return len(self.faces) - len(self._group_of) + sextics

    def scale_of(self, number: int) -> float:
        """Radius of the patches of a free-form face, length."""
        surface = self.free_form(number)
        return surface.radius if surface else self.radius

    def with_surface(self, surface: FreeFormSurface) -> "FaceTrees":
        """The same, where all samples are one free-form face, with another surface of it."""
        found = copy(self)
        found._surfaces = {(0,): surface}
        return found

    def first_of(self, number: int) -> int:
        """The first of the faces that have one surface with a face."""
        return self._group_of.get(number, (number,))[0]

    def free_form(self, number: int) -> FreeFormSurface | None:
        """The surface of a free-form face; None of a lawful one."""
        return self._of_group(self._group_of[number]) if number in self._group_of else None

    def _of_group(self, group: tuple[int, ...]) -> FreeFormSurface:
        """The surface of a group of faces."""
        if group not in self._surfaces:
            self._surfaces[group] = self._fitted(group)
        return self._surfaces[group]

    @property
    def _all_free_form(self) -> dict[int, FreeFormSurface]:
        """The free-form surfaces, each by the first of its faces."""
        return {g[0]: self._of_group(g) for g in self.groups if g[0] in self._group_of}

    @cached_property
    def _group_of(self) -> dict[int, tuple[int, ...]]:
        """The faces, ascending, of the free-form surface of each face that is a part of one: those
        that hang together by smooth rims."""
        faces = self.faces.faces
        bent = [face.id for face in faces if self._may_be_free_form(face)]
        smooth = [edge for edge in self.faces.edges if edge.kind is EdgeKind.SMOOTH_RIM]
        pairs = [(edge.first, edge.second) for edge in smooth]
        of = linked(len(faces), [pair for pair in pairs if set(pair) <= set(bent)])
        groups = [tuple(k for k in bent if of[k] == one) for one in dict.fromkeys(of[bent])]
        groups = [group for group in groups if any(faces[k].law is None for k in group)]
        return {number: group for group in groups for number in group}

    def _may_be_free_form(self, face: Face) -> bool:
        """Whether a face obeys no law, or only one that says little."""
        if face.law is None or face.kind == "quadric":
            return True
        return box_diagonal(self.faces.points[face.samples]) <= 2.0 * self.radius

    def _fitted(self, group: tuple[int, ...]) -> FreeFormSurface:
        """The surface of faces, from their samples and those without a label that lie on it."""
        faces = self.faces
        own = np.concatenate([faces.faces[k].samples for k in group])
        points, normals, stds = faces.points[own], faces.normals[own], faces.stds[own]
        how = faces.std, self.radius, self._before, faces.levels
        found = fit_free_form(points, normals, *how, stds, faces.tried or None)
        if len(faces) == 1:
            return replace(found, pairs=faces.turns) if faces.is_sharp else found
        left = np.setdiff1d(np.flatnonzero(faces.of == NONE), faces.rounded)
        left = left[are_on(found, faces.points[left], faces.std, faces.levels)]
        if not len(left):
            return found
        loose, every = faces.points[left], np.concatenate([stds, faces.stds[left]])
        normals = np.concatenate([normals, found.values(loose)[:, 1:4]])
        points = np.concatenate([points, loose])
        return fit_free_form(points, normals, faces.std, self.radius, None, faces.levels, every)


class FacesAt:
    """What all faces say of n points, each asked once.

    Parameters
    ----------
    trees : FaceTrees
    points : (n, 3) float, length
    distances : (n, f) float, length
        Signed, from all faces.
    means : dict
        Of each free-form surface, by the first of its faces, the mean of its sextics.
    """

    def __init__(self, trees: FaceTrees, points, distances, means: dict[int, Mean]) -> None:
        self.trees, self.points, self.distances = trees, points, distances
        self._means, self._rows = means, np.arange(len(points))
        # By the first face of each surface, the points (n,) that were asked, and what it said.
        self._found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._count = len(points)

    def some(self, rows) -> "FacesAt":
        """The same of some of the points (m,)."""
        found = copy(self)
        found.points, found.distances = self.points[rows], self.distances[rows]
        found._rows = self._rows[rows]
        return found

    def values(self, number: int, rows) -> np.ndarray:
        """(m, 5) distance, normal and variance of a face at some of the points (m,)."""
        first = self.trees.first_of(number)
        if first not in self._found:
            self._found[first] = np.zeros(self._count, bool), np.empty((self._count, 5))
        known, found = self._found[first]
        own = self._rows[rows]
        new = ~known[own]
        if new.any():
            found[own[new]] = self._values(first, own[new], self.points[rows][new])
            known[own] = True
        return np.asarray(found[own])

    def _values(self, number: int, own, points) -> np.ndarray:
        """(m, 5) the same, of points (m, 3) with places (m,) among all that are asked."""
        if (surface := self.trees.free_form(number)) is None:
            return self.trees.of(number).values(points)
        return surface.values_of(self._means[number].some(own), points)


def curve_tree(edge: FaceEdge) -> cKDTree:
    """The curves of an edge by place."""
    return cKDTree(np.concatenate([_finer(curve) for curve in edge.curves]))


def _finer(curve) -> np.ndarray:
    """(k, 3) points along the straight lines between those of a curve."""
    at = np.linspace(0.0, len(curve) - 1.0, 8 * len(curve))
    steps = np.arange(len(curve))
    return np.stack([np.interp(at, steps, column) for column in curve.T], axis=1)


def off_box(tree: cKDTree, points) -> np.ndarray:
    """(n,) distances of points (n, 3) from the box about those of a tree, length: none of these is
    nearer, whatever its distance is rounded to."""
    off = np.maximum(np.maximum(tree.mins - points, points - tree.maxes), 0.0)
    return np.asarray((1.0 - 1e-12) * np.sqrt(np.einsum("ij,ij->i", off, off)))
