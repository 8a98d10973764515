"""Body: the surface that faces show, and where it is known."""

from copy import copy
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.thinned_samples import ThinnedSamples
from touchatlas.atlas.faces.face_corners import on_ball
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.field.face_field import FaceField, FaceValues
from touchatlas.atlas.field.passed_air import air_inside, through_openings
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.surfaces.free_form import FreeFormSurface

# Height above or below the surface up to which a point may be known, over the reach of samples: a
# cube that the surface passes has all its corners there, see ``WITHIN_REACH``.
HEIGHT = 0.4
# Distance beyond its samples to which a face is known, in steps of its contours: a contour ends up
# to a step before what stopped it.
_BEYOND_SAMPLES = 1.5
# Distance beyond a rim to which the surface is known, over the reach: triangles are cut at the rim.
_BEYOND_RIM = 0.25


class Body:
    """The surface of a body, drawn from faces of any kind.

    Parameters
    ----------
    faces : Faces
    samples : ContourSamples
    before : Body, optional
        That of the first of the samples, if it is one free-form face as well: what did not change
        is not fitted again. The result is the same without it.

    Attributes
    ----------
    rims : Rims or None
        Where the surface ends because contact was lost; that of the atlas, which sets it.
    """

    def __init__(self, faces: Faces, samples: ContourSamples, before: "Body | None" = None) -> None:
        self.faces, self.samples = faces, samples
        self.rims: Rims | None = None
        points = samples.points
        self.extent = samples.extent
        self.field: FaceField = FaceField(faces, None if before is None else before.field.trees)
        self.reach = self.field.reach
        self._thinned = ThinnedSamples(points, faces, self.reach)
        self._tree = cKDTree(points)
        # A contour oblique to its face has no normal to be labelled by, but may well lie on it.
        self._astray = faces.of == NONE
        left, sure = points[self._astray], samples.levels.sure * samples.stds[self._astray]
        off = np.abs(self.field.at(left).distance)
        self._misses = np.zeros(len(points))
        self._misses[self._astray] = np.where(off > sure, off, 0.0)
        self._astray = self._misses > 0.0

    def with_surface(self, surface: FreeFormSurface) -> "Body":
        """The same body of one free-form face, with another surface of it."""
        found = copy(self)
        # What was computed from the surface before.
        found.__dict__.pop("largest_curvature", None)
        found.field = self.field.with_surface(surface)
        return found

    def with_air(self, ways, rims: Rims | None = None) -> "Body":
        """The same body without what is on straight ways (m, 2, 3), length, world, given by their
        ends: a probe passed there. It ends at rims, and a way through an opening leaves it whole:
        what ends is a sheet, with air on both sides."""
        found = copy(self)
        found.field = bare = self.field.with_air(None)

        def is_known(points):
            distance, normal = bare.level(points)
            return found.at(points - distance[:, None] * normal)[1]

        def is_open(points, normals):
            return rims.beyond(points, normals) | rims.at(points, _BEYOND_RIM * self.reach)

        if rims and len(ways):
            ways = ways[~through_openings(ways, bare.level, is_open)]
        air = air_inside(
            ways,
            lambda points: bare.level(points)[0],
            self.away,
            is_known,
            self.reach,
            self.samples.std,
            self.samples.levels.sure,
        )
        found.field, found.rims = bare.with_air(air), rims
        return found

    @property
    def is_one_face(self) -> bool:
        """Whether all samples are one face, lawful or free-form, so that there is no edge."""
        return self.field.is_one_face

    @property
    def seeds(self) -> np.ndarray:
        """(m, 3) samples all over the body, length, world."""
        return self._thinned.points

    @property
    def patch_count(self) -> int:
        """Number of patches: the pieces of lawful faces, and the sextics of free-form ones."""
        return self.field.trees.patch_count

    @cached_property
    def largest_curvature(self) -> float:
        """Largest absolute principal curvature of the faces, 1/length."""
        found = [0.0]
        for face in self.faces.faces:
            at = self.samples.points[face.samples[:: max(1, len(face.samples) // 16)]]
            shape = self.field.trees.of(face.id).shape_operators(at)
            found.append(float(np.abs(np.linalg.eigvalsh(shape)).max(axis=1).mean()))
        return max(found)

    @cached_property
    def thickness(self) -> float:
        """Least distance of two sides that face away from each other, length."""
        return self._thinned.thickness()

    def away(self, points) -> np.ndarray:
        """(n,) distances of points (n, 3) from the nearest sample, length."""
        return np.asarray(self._tree.query(points)[0])

    def misses(self, points) -> np.ndarray:
        """(n,) by how much the surface misses the samples nearest to points (n, 3), length; 0 of
        those that noise explains."""
        return np.asarray(self._misses[self._tree.query(points)[1]])

    def at(self, points) -> tuple[FaceValues, np.ndarray]:
        """What the faces say of points (n, 3), and whether (n,) the surface is known there: among
        samples, where the deviation that the coefficients predict is not vague.

        This depends on samples and levels, and not on the tolerance, so that touches do not: only
        the end of an exploration compares deviations with it. Those that users get are
        ``PredictiveLaw.deviations`` of the predicted ones.
        """
        found, known, unsure = self.among(points)
        doubt = np.flatnonzero(unsure)
        if len(doubt):
            known[doubt] = self.is_sure(points[doubt], found.distance[doubt], found.normal[doubt])
        return found, known

    def is_sure(self, points, distance, normal) -> np.ndarray:
        """(n,) whether the deviation is not vague at the feet of points (n, 3), which their
        distances (n,) and normals (n, 3) lead to: beside the surface a polynomial is less sure than
        on it."""
        for _ in range(2):
            points = points - distance[:, None] * normal
            distance, normal = self.field.level(points)
        return ~self._is_vague(self.field.at(points - distance[:, None] * normal).deviation)

    def _is_vague(self, deviation) -> np.ndarray:
        """(n,) whether deviations (n,), length, are so large that a surface shows nothing: larger
        than the level, and than that of a sample. Between samples far apart polynomials have zeros
        anywhere."""
        levels = self.samples.levels
        limit = levels.vague * levels.believed * self.extent
        return np.asarray(deviation > max(limit, self.samples.std))

    def among(self, points) -> tuple[FaceValues, np.ndarray, np.ndarray]:
        """What the faces say of points (n, 3); whether (n,) they lie among samples: none of these
        are farther than ``reach``, and no half circle about the foot is without one; or a little
        beyond a rim, or beyond the samples of a face; and which (n,) of them lie there, but with a
        vague deviation, so that ``is_sure`` has to be asked whether the surface is known."""
        found = self.field.at(points)
        away, nearest = self._tree.query(points)
        steps = self.samples.steps[nearest]
        height = np.clip(found.distance, -HEIGHT * self.reach, HEIGHT * self.reach)
        off = np.abs(height)
        known = away <= _BEYOND_SAMPLES * steps + off
        doubt = np.flatnonzero(~known & (away < self.reach))
        normals = found.normal[doubt]
        feet = points[doubt] - height[doubt, None] * normals
        known[doubt] = self._thinned.surround(feet, normals)
        if self.rims:
            known |= (away < self.reach) & self.rims.at(points, _BEYOND_RIM * self.reach)
        # What nothing explains is not known.
        known &= ~self._astray[nearest] | (away < steps + off)
        return found, known, known & self._is_vague(found.deviation)

    def beyond(self, points, normals) -> np.ndarray:
        """(n,) whether points (n, 3) of the surface, with its normals (n, 3), lie beyond a rim at
        which contact was lost. A rim amid samples that one touch alone shows is a slip of the
        probe."""
        if not self.rims:
            return np.zeros(len(points), bool)
        shown = self.rims.shown_beyond(points, normals)
        out, alone = shown > 0, np.flatnonzero(shown == 1)
        out[alone] = ~self._thinned.surround(points[alone], normals[alone])
        return out

    def gaussian_curvature(self, points, face) -> np.ndarray:
        """(n,) Gaussian curvature of faces (n,) at points (n, 3), 1/length^2: the second invariant
        of the shape operator, one of whose eigenvalues is 0 (do Carmo, section 3-3). Beside a
        ball, which rounds a corner, it is that of the parallel surface: one over the square of the
        distance from its centre."""
        out = np.zeros(len(points))
        for one in self.faces.faces:
            mine = np.flatnonzero(face == one.id)
            shape = self.field.trees.of(one.id).shape_operators(points[mine])
            trace = np.trace(shape, axis1=1, axis2=2)
            out[mine] = 0.5 * (trace**2 - np.einsum("nij,nji->n", shape, shape))
        for corner in self.faces.corners:
            square, off = ((points - corner.centre) ** 2).sum(axis=1), 0.1 * corner.radius
            near = np.flatnonzero(square < (corner.radius + 2.0 * off) ** 2)
            near = near[on_ball(corner, self.faces.faces, points[near], off)]
            out[near] = 1.0 / square[near]
        return out
