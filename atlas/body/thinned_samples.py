"""ThinnedSamples: samples evenly all over a body, and whether points lie among them."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.labels import NONE
from touchatlas.patch.geometry.arrays import cross

# Parts of the reach of a sample in which one sample of each face, or of roundings, is kept.
# Doubled, it takes four times as long.
_PARTS = 6
# Samples about a point that tell whether it lies among them: most do among the first. The last
# doubled, nothing changes.
_FIRST, _ABOUT = 12, 48
# Largest angle about a point in which there is no sample, rad: less than half a circle, as within a
# convex hull. Doubled, everything is within.
_GAP = np.deg2rad(170.0)
# Least sine of the angle between two faces that are unfolded. Doubled, blunt edges are none.
_FOLDED = 0.2
# Least cosine of the normal at a point and at a sample of the same part of the surface: 107
# degrees, for the far side of an edge. Doubled, samples of the other side of a wall count.
_FACING = -0.3
# What is added to the sine of half of the turn between a point and a sample, by which the chord
# between them may be off that of an arc, for surfaces that bend to and fro: 14 degrees where both
# face alike; where they differ by 97 degrees or more, any chord passes. Without this, a place
# inside of a solid that faces as the samples above it do lies among these: of seven explorations of
# a wing nut one ended as known with five false pockets. Doubled, such pockets stay where they are
# flat.
_TO_AND_FRO = 0.25
# Least cosine of the normal at a point and at a sample that faces as it does, 80 degrees, and
# largest angle about a point in which there is no such sample, rad, on a body without sharp edges:
# a little more than half a circle, as on a ridge between two contours that run over it. Without
# this a cap that sextics put on a finger lies among samples of its sides: of five explorations of
# a hand one ended as known without a finger; all five have all fingers with it. On a part with
# sharp edges (featuretype) 0.93 instead of 0.95 of the surface that claims half a tolerance after
# eight touches would be within three. With the cosine doubled, and no other rule, a torus takes
# more touches.
_ALIKE, _GAP_ALIKE = 0.17, np.deg2rad(210.0)


class ThinnedSamples:
    """Samples of faces and of roundings, one in each cube of a sixth of the ``reach`` of samples.

    Parameters
    ----------
    points : (n, 3) float, length, world
        All samples.
    faces : Faces
        Of these samples.
    reach : float, length
    """

    def __init__(self, points, faces: Faces, reach: float) -> None:
        self.reach = reach
        self._is_one_smooth_face = len(faces) == 1 and not faces.is_sharp
        voxel = np.floor((points - points[0]) * _PARTS / reach).astype(np.int64)
        # Both sides of a thin wall may lie in one cube.
        sides = np.column_stack([voxel, faces.of])
        sides -= sides.min(axis=0)
        keys = np.ravel_multi_index(tuple(sides.T), tuple(sides.max(axis=0) + 1))
        _, first = np.unique(keys, return_index=True)
        explained = faces.of != NONE
        explained[faces.rounded] = True
        kept = np.sort(first[explained[first]])
        self.points: np.ndarray = points[kept]
        self.normals: np.ndarray = faces.normals[kept]
        self._of_faces = faces.of[kept] != NONE
        self._tree = cKDTree(self.points)

    def thickness(self) -> float:
        """Least distance of two sides that face away from each other, length: the distance that 98
        of 100 of their samples exceed; infinite where there are none.

        Samples of roundings do not count: a contour that runs along one does not show its normals.
        """
        points, normals = self.points[self._of_faces], self.normals[self._of_faces]
        count = min(_ABOUT, len(points))
        if not count:
            return np.inf
        away, near = (np.reshape(x, (-1, count)) for x in cKDTree(points).query(points, k=count))
        one, other = np.nonzero(np.einsum("nkj,nj->nk", normals[near], normals) < -0.5)
        away, near = away[one, other], near[one, other]
        through = np.abs(((points[near] - points[one]) * normals[one]).sum(axis=1))
        opposite = through > 0.7 * away
        least = np.full(len(points), np.inf)
        np.minimum.at(least, one[opposite], through[opposite])
        found = least[np.isfinite(least)]
        return float(np.quantile(found, 0.02)) if len(found) else np.inf

    def surround(self, points, normals) -> np.ndarray:
        """(n,) whether points (n, 3) of the surface, with normals (n, 3), lie among samples within
        reach to which a surface may bend from there: no half circle about such a point is without
        one, and, on a body without sharp edges, none much larger without one that faces as it
        does."""
        out = np.zeros(len(points), bool)
        for count in (_FIRST, _ABOUT):
            rest = np.flatnonzero(~out)
            if len(rest):
                out[rest] = self._surround(points[rest], normals[rest], count)
        return out

    def _surround(self, points, normals, count: int) -> np.ndarray:
        """The same by so many nearest samples alone."""
        count = min(count, len(self.points))
        _, near = self._tree.query(points, k=count, distance_upper_bound=self.reach)
        near = near.reshape(len(points), count)
        there = near < len(self.points)
        near = np.where(there, near, 0)
        east = cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
        east /= np.linalg.norm(east, axis=1)[:, None]
        frames = np.stack([east, cross(normals, east), normals], axis=2)
        outward = self.normals[near] @ frames
        offset = (self.points[near] - points[:, None]) @ frames
        there &= outward[..., 2] > _FACING
        there &= _on_one_arc(offset, outward)
        # What lies beyond an edge is unfolded about it into the tangent plane.
        length = np.sqrt(np.maximum(1.0 - outward[..., 2] ** 2, 0.0))
        fold = np.where(length > _FOLDED, offset[..., 2] / np.maximum(length, _FOLDED), 0.0)
        x, y, _ = np.moveaxis(offset - fold[..., None] * outward, 2, 0)
        angle = np.arctan2(y, x)
        found = _widest_gap(angle, there) < _GAP
        if self._is_one_smooth_face:
            found &= _widest_gap(angle, there & (outward[..., 2] > _ALIKE)) < _GAP_ALIKE
        return found


def _on_one_arc(offset, outward) -> np.ndarray:
    """(n, k) whether a surface of normal z may bend from the origin to samples at ``offset``
    (n, k, 3) with normals ``outward`` (n, k, 3) without turning to and fro.

    On an arc the chord is at right angles to the sum of the normals at its ends. Over an edge by
    which two planes turn by an angle t it is off that by t / 2 at most.
    """
    both = outward + [0.0, 0.0, 1.0]
    square = (both * both).sum(axis=2)
    off = (offset * both).sum(axis=2)
    length = np.sqrt((offset * offset).sum(axis=2) * square)
    # |both| is 2 cos(t / 2).
    half = np.sqrt(np.maximum(1.0 - 0.25 * square, 0.0))
    return np.asarray(np.abs(off) <= (half + _TO_AND_FRO) * length)


def _widest_gap(angle, there) -> np.ndarray:
    """(n,) largest angle between neighbours among angles (n, k), rad, of those that are ``there``
    (n, k); a full circle where none is."""
    angle = np.where(there, angle, -np.pi)
    # What is not there takes the place of the last one.
    angle = np.sort(np.where(there, angle, angle.max(axis=1, keepdims=True)), axis=1)
    gap = np.diff(angle, axis=1, append=angle[:, :1] + 2.0 * np.pi)
    return np.asarray(gap.max(axis=1))
