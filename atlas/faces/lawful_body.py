"""LawfulBody: the surface of a body all of whose faces obey a law and of which edges are seen."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.face_corners import on_ball
from touchatlas.atlas.faces.face_field import FaceField, FaceValues
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.labels import NONE
from touchatlas.atlas.faces.samples import ContourSamples
from touchatlas.atlas.samples.rims import Rims
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.kinks import kinks

# Least fraction of the samples that lawful faces explain; the rest is unknown, and touched again.
# With twice the rest left out, free-form parts of a body are drawn as planes.
_LAWFUL = 0.9
# Difference of the slopes on both sides of an edge of 35 degrees. Halved, folds of scanned skin are
# sharp edges.
_SHARP = 2.0 * np.tan(np.deg2rad(17.5))
# Parts of that distance from which samples are thinned out. Doubled, it takes four times as long.
_PARTS = 6
# Samples about a point that tell whether it lies among them: most do among the first. The last
# doubled, nothing changes.
_FIRST, _ABOUT = 12, 48
# Distance beyond the samples up to which a face is known, in steps of its contours. Doubled, faces
# go on beyond edges that no contour crossed.
_STEPS = 1.5
# Deviation over ``reach`` beyond which a surface shows nothing: between samples far apart
# polynomials have zeros anywhere. Doubled, more of such is drawn while little is known.
_VAGUE = 0.1
# Distance from a rim within which the surface is known although samples lie on one side alone,
# over ``reach``. Doubled, more of what no contour crossed counts as known.
_AT_RIM = 0.25
# Distance from the surface up to which it is asked what is known at the foot, over ``reach``: cubes
# are smaller. Doubled, the sides of thin walls are confused.
_OFF = 0.4
# Largest angle about a point in which there is no sample, rad: less than half a circle, as within a
# convex hull. Doubled, everything is within.
_GAP = np.deg2rad(170.0)
# Distance from the ball of a corner at which a point is on it, in radii. Doubled, nothing changes:
# points of the surface are asked.
_ROUNDED = 0.1
# Distance from the faces at which a sample without a label lies on them, in standard deviations.
# Doubled, less is left out where a small part of another shape is touched.
_ON_FACE = 3.0
# Distance from the surface at which a sample contradicts it, in standard deviations. Doubled, a
# wing nut is drawn from faces that leave 42 handles.
_BESIDE_SURFACE = 5.0
# Least sine of the angle between two faces that are unfolded. Doubled, blunt edges are none.
_FOLDED = 0.2
# Least cosine of the normal at a point and at a sample of the same part of the surface: 107
# degrees, for the far side of an edge. Doubled, samples of the other side of a wall count.
_FACING = -0.3


class LawfulBody:
    """The surface of a body whose faces are planes, spheres, cylinders and quadrics.

    Parameters
    ----------
    faces : Faces
    samples : ContourSamples
    before : LawfulBody, optional
        That of the first of the samples, if it is one free-form face as well: what did not change
        is not fitted again. The result is the same without it.

    Attributes
    ----------
    rims : Rims or None
        Where the surface ends because contact was lost; that of the atlas, which sets it.
    """

    def __init__(
        self,
        faces: Faces,
        samples: ContourSamples,
        before: "LawfulBody | None" = None,
    ) -> None:
        self.faces, self.samples = faces, samples
        self.rims: Rims | None = None
        points = samples.points
        self.extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        self.field: FaceField = FaceField(faces, None if before is None else before.field.trees)
        self.reach = self.field.reach
        voxel = np.floor((points - points[0]) * _PARTS / self.reach).astype(np.int64)
        # Both sides of a thin wall may lie in one voxel.
        sides = np.column_stack([voxel, faces.of])
        sides -= sides.min(axis=0)
        keys = np.ravel_multi_index(tuple(sides.T), tuple(sides.max(axis=0) + 1))
        _, first = np.unique(keys, return_index=True)
        self._thin = np.sort(first[faces.of[first] != NONE])
        self._thin_tree, self._tree = cKDTree(points[self._thin]), cKDTree(points)
        self._normals = faces.normals[self._thin]
        # A contour oblique to its face has no normal to be labelled by, but may well lie on it.
        self._astray = faces.of == NONE
        left = points[self._astray]
        self._astray[self._astray] = np.abs(self.field.at(left).distance) > _ON_FACE * samples.std

    @property
    def seeds(self) -> np.ndarray:
        """(m, 3) samples all over the body, length, world."""
        return self.samples.points[self._thin]

    @property
    def patch_count(self) -> int:
        """Number of patches: the pieces of lawful faces, and the sextics of free-form ones."""
        return len(self.field.trees.patches)

    @cached_property
    def contradicted(self) -> float:
        """Fraction of the samples of faces beside which the surface passes, by more than five
        standard deviations."""
        off = np.abs(self.field.at(self.seeds).distance)
        return float((off > _BESIDE_SURFACE * self.samples.std).mean())

    @cached_property
    def largest_curvature(self) -> float:
        """Largest absolute principal curvature of the faces, 1/length."""
        found = [0.0]
        for face in self.faces.faces:
            at = self.samples.points[face.samples[:: max(1, len(face.samples) // 16)]]
            shape = self.field.trees.shape_operators(face.id, at)
            found.append(float(np.abs(np.linalg.eigvalsh(shape)).max(axis=1).mean()))
        return max(found)

    @cached_property
    def thickness(self) -> float:
        """Least distance of two sides that face away from each other, length: the distance that 98
        of 100 of their samples exceed; infinite where there are none."""
        points, normals = self.seeds, self._normals
        away, near = self._thin_tree.query(points, k=min(_ABOUT, len(points)))
        one, other = np.nonzero(np.einsum("nkj,nj->nk", normals[near], normals) < -0.5)
        away, near = away[one, other], near[one, other]
        through = np.abs(((points[near] - points[one]) * normals[one]).sum(axis=1))
        opposite = through > 0.7 * away
        least = np.full(len(points), np.inf)
        np.minimum.at(least, one[opposite], through[opposite])
        found = least[np.isfinite(least)]
        return float(np.quantile(found, 0.02)) if len(found) else np.inf

    def away(self, points) -> np.ndarray:
        """(n,) distances of points (n, 3) from the nearest sample, length."""
        return np.asarray(self._tree.query(points)[0])

    def at(self, points) -> tuple[FaceValues, np.ndarray]:
        """What the faces say of points (n, 3), and whether (n,) the surface is known there.

        It is known among samples: where none of them are farther than ``reach``, and no half circle
        about the point is without one; and a little beyond rims.
        """
        found = self.field.at(points)
        away, nearest = self._tree.query(points)
        steps = self.samples.steps[nearest]
        off = np.minimum(np.abs(found.distance), _OFF * self.reach)
        known = away <= _STEPS * steps + off
        doubt = np.flatnonzero(~known & (away < self.reach))
        for count in (_FIRST, _ABOUT):
            doubt = doubt[~known[doubt]]
            known[doubt] = self._is_among(points[doubt], found.normal[doubt], count)
        if self.rims:
            known |= (away < self.reach) & self.rims.at(points, _AT_RIM * self.reach)
        self._leave_out_vague(points, found, known)
        # What nothing explains is not known.
        known &= ~self._astray[nearest] | (away < steps + off)
        return found, known

    def _leave_out_vague(self, points, found: FaceValues, known) -> None:
        """Mark as unknown the points (n, 3) whose feet are vague: beside the surface a polynomial
        is less sure than on it."""
        vague = np.flatnonzero(known & (found.deviation > _VAGUE * self.reach))
        feet = points[vague] - found.distance[vague, None] * found.normal[vague]
        known[vague] = self.field.at(feet).deviation <= _VAGUE * self.reach

    def beyond(self, points, normals) -> np.ndarray:
        """(n,) whether points (n, 3) of the surface, with its normals (n, 3), lie beyond a rim at
        which contact was lost, and not among samples: a rim amid samples is a slip of the probe."""
        if not self.rims:
            return np.zeros(len(points), bool)
        out = self.rims.beyond(points, normals)
        for count in (_FIRST, _ABOUT):
            some = np.flatnonzero(out)
            out[some] = ~self._is_among(points[some], normals[some], count)
        return out

    def gaussian_curvature(self, points, face) -> np.ndarray:
        """(n,) Gaussian curvature of faces (n,) at points (n, 3), 1/length^2: the second invariant
        of the shape operator, one of whose eigenvalues is 0 (do Carmo, section 3-3). That of a
        ball of radius r, which rounds a corner, is 1 / r^2."""
        out = np.zeros(len(points))
        for one in self.faces.faces:
            mine = np.flatnonzero(face == one.id)
            shape = self.field.trees.shape_operators(one.id, points[mine])
            trace = np.trace(shape, axis1=1, axis2=2)
            out[mine] = 0.5 * (trace**2 - np.einsum("nij,nji->n", shape, shape))
        for corner in self.faces.corners:
            off = _ROUNDED * corner.radius
            out[on_ball(corner, self.faces.faces, points, off)] = corner.radius**-2.0
        return out

    def _is_among(self, points, normals, count: int) -> np.ndarray:
        """(n,) whether points (n, 3) with normals (n, 3) lie among so many nearest samples within
        reach."""
        count = min(count, len(self._thin))
        if not len(points):
            return np.zeros(0, bool)
        _, near = self._thin_tree.query(points, k=count, distance_upper_bound=self.reach)
        near = near.reshape(len(points), count)
        there = near < len(self._thin)
        near = np.where(there, near, 0)
        east = cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
        frames = np.stack([east, cross(normals, east), normals], axis=2)
        outward = self._normals[near] @ frames
        offset = (self.seeds[near] - points[:, None]) @ frames
        there &= outward[..., 2] > _FACING
        # What lies beyond an edge is unfolded about it into the tangent plane.
        length = np.sqrt(np.maximum(1.0 - outward[..., 2] ** 2, 0.0))
        fold = np.where(length > _FOLDED, offset[..., 2] / np.maximum(length, _FOLDED), 0.0)
        x, y, _ = np.moveaxis(offset - fold[..., None] * outward, 2, 0)
        angle = np.where(there, np.arctan2(y, x), -np.pi)
        # What is not there takes the place of the last one.
        angle = np.sort(np.where(there, angle, angle.max(axis=1, keepdims=True)), axis=1)
        widest = np.diff(angle, axis=1, append=angle[:, :1] + 2.0 * np.pi).max(axis=1)
        return np.asarray(widest < _GAP)


def determined(faces: Faces, samples: ContourSamples) -> Faces:
    """The same without the faces that one contour alone has met, or another with few samples: a
    curve in a plane determines no face. Their samples belong to none."""
    kept = [face for face in faces.faces if samples.are_of_several_contours(face.samples)]
    number = {face.id: k for k, face in enumerate(kept)}
    table = np.array([number.get(face.id, NONE) for face in faces.faces] + [NONE])
    edges = tuple(
        replace(edge, first=number[edge.first], second=number[edge.second])
        for edge in faces.edges
        if edge.first in number and edge.second in number
    )
    corners = tuple(
        replace(corner, faces=(number[a], number[b], number[c]))
        for corner in faces.corners
        for a, b, c in [corner.faces]
        if {a, b, c} <= number.keys()
    )
    found = tuple(replace(face, id=k) for k, face in enumerate(kept))
    return replace(faces, faces=found, edges=edges, of=table[faces.of], corners=corners)


def share_with_edges(samples: ContourSamples, ends_at_edge) -> float:
    """Fraction of the contours that run over a sharp edge, or of which a sample (n,) is the last
    before one."""
    bounds = np.append(np.flatnonzero(np.diff(samples.contours, prepend=-1)), len(samples))
    found = [
        bool(ends_at_edge[a:b].any())
        or len(kinks(samples.points[a:b], samples.planes[a], samples.std)) > 0
        for a, b in zip(bounds[:-1], bounds[1:], strict=True)
    ]
    return float(np.mean(found))


def share_over_sharp_edges(samples: ContourSamples) -> float:
    """Fraction of the contours that turn by 35 degrees or more at a sharp edge."""
    bounds = np.append(np.flatnonzero(np.diff(samples.contours, prepend=-1)), len(samples))
    found = [
        len(kinks(samples.points[a:b], samples.planes[a], samples.std, least_turn=_SHARP)) > 0
        for a, b in zip(bounds[:-1], bounds[1:], strict=True)
    ]
    return float(np.mean(found))


def lawful_share(faces: Faces) -> float:
    """Fraction of the samples that lawful faces explain, and the rounding of their edges."""
    lawful = [face.id for face in faces.faces if face.law is not None]
    if not len(faces.of):
        return 0.0
    count = np.count_nonzero(np.isin(faces.of, lawful)) + len(faces.rounded)
    return count / len(faces.of)


def is_lawful(faces: Faces) -> bool:
    """Whether lawful faces explain nearly all samples."""
    return len(faces) > 1 and lawful_share(faces) >= _LAWFUL


def is_explained(faces: Faces) -> bool:
    """Whether faces of any kind, some of which meet in sharp edges, explain nearly all samples."""
    return 1.0 - faces.unexplained >= _LAWFUL and any(edge.kind.sharp for edge in faces.edges)
