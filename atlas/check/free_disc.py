"""FreeDisc: the largest disc on a surface without a sample, which is how large a hole or a horn may
have been missed."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.check.doubt import Doubt, missed_words
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import cross

# Share of the diameter to which a disc is the largest.
_NEARLY = 0.01


@dataclass(frozen=True, eq=False)
class FreeDisc:
    """A disc on a surface that holds no sample.

    A hole or a horn whose foot has this diameter may be there. It is known of no larger one that a
    contour crossed it.

    Parameters
    ----------
    centre : (3,) float, length, world
    normal : (3,) float, unit, world
        Of the surface at the centre.
    diameter : float, length
    """

    centre: np.ndarray
    normal: np.ndarray
    diameter: float

    @property
    def words(self) -> str:
        """What may have been missed, as a sentence."""
        return missed_words(self.diameter, self.centre)


def disc_numbers(disc: FreeDisc | None) -> dict:
    """Diameter and centre of a disc, ready for JSON."""
    return {
        "free_disc": None if disc is None else disc.diameter,
        "free_disc_place": None if disc is None else disc.centre.tolist(),
    }


def feature_doubts(numbers: dict) -> list[Doubt]:
    """One doubt where a feature that was asked for may have been missed; ``numbers`` are those of a
    run."""
    diameter, asked = numbers.get("free_disc"), numbers.get("feature")
    if not (diameter and asked and diameter >= asked):
        return []
    place = np.array(numbers["free_disc_place"])
    words = f"{missed_words(diameter, place)} Not more than {asked:.3g} was asked for; touch there."
    return [Doubt("missed feature", words, place[None])]


def free_disc_of(atlas: AtlasState, corners, besides=()) -> FreeDisc | None:
    """The largest disc without a sample on triangles (n, 3, 3) of the surface of an atlas, and
    without any of the points ``besides`` (k, 3); None without triangles."""
    pool, others = atlas.pool, np.reshape(besides, (-1, 3))
    points = np.concatenate([pool.points, others])
    # A point without a normal faces no side, and counts on either.
    normals = np.concatenate([pool.normals, np.zeros_like(others)])
    return largest_free_disc(corners, points, normals, atlas.levels)


def largest_free_disc(corners, points, normals, levels: Levels = Levels()) -> FreeDisc | None:
    """The largest disc on triangles that holds none of some points; None without triangles.

    A disc is the part of the surface within a ball about a point of it, so that a straight hole or
    horn across the surface fits in one of its own diameter. Points on the far side of a thin wall,
    which face away from the surface, are not in the disc.

    Parameters
    ----------
    corners : (n, 3, 3) float, length, world
        Counter-clockwise seen from outside.
    points, normals : (m, 3) float, length; unit, world
    levels : Levels

    Notes
    -----
    The largest empty circle (Shamos and Hoey, Closest-point problems, 1975) with its centre on a
    surface. The distance from the nearest point grows by no more than the way on a triangle, so
    that branch and bound (Land and Doig 1960) over triangles and their quarters finds it, within a
    hundredth of the diameter.

    Examples
    --------
    Four samples at the corners of a square of 2: the largest disc is about its middle.

    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    >>> up = np.tile([0.0, 0.0, 1.0], (4, 1))
    >>> disc = largest_free_disc(square[[[0, 1, 2], [0, 2, 3]]], square, up)
    >>> round(disc.diameter, 1), disc.centre.round(1).tolist()
    (2.8, [1.0, 1.0, 0.0])
    """
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.sqrt((across * across).sum(axis=1))
    corners, across = corners[double > 0.0], across[double > 0.0]
    if not len(corners) or not len(points):
        return None
    outward = across / double[double > 0.0][:, None]
    nearest = _Facing(points, normals, levels.facing)
    best, found = -1.0, (corners[0, 0], outward[0])
    while len(corners):
        middle = corners.mean(axis=1)
        radius = nearest.distances(middle, outward)
        first = int(radius.argmax())
        if radius[first] > best:
            best, found = float(radius[first]), (middle[first], outward[first])
        within = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2)).max(axis=1)
        open_ = radius + within > (1.0 + _NEARLY) * best
        corners, outward = _quarters(corners[open_]), np.repeat(outward[open_], 4, axis=0)
    return FreeDisc(*found, 2.0 * best)


class _Facing:
    """Points (m, 3) with their normals, for the nearest one that does not face away from a place:
    whose normal has a cosine of -``facing`` or more with the one there."""

    def __init__(self, points, normals, facing: float) -> None:
        self._points, self._normals, self._facing = points, normals, facing
        self._tree = cKDTree(points)
        # Of points that may face a direction, by that.
        self._groups: dict[tuple[float, ...], tuple[cKDTree, np.ndarray]] = {}

    def distances(self, at, outward) -> np.ndarray:
        """(n,) of places (n, 3) with normals (n, 3) from the nearest such point, length; from the
        nearest of all where all face away."""
        out, near = self._tree.query(at)
        away = np.flatnonzero((self._normals[near] * outward).sum(axis=1) < -self._facing)
        # A wall that is thinner than its samples are apart has many that face away.
        axes, group = np.unique(np.round(outward[away]), axis=0, return_inverse=True)
        for k, axis in enumerate(axes):
            own = away[group.ravel() == k]
            tree, normals = self._group(axis)
            found = self._among(tree, normals, at[own], outward[own])
            out[own] = np.where(np.isfinite(found), found, out[own])
        return out

    def _group(self, axis) -> tuple[cKDTree, np.ndarray]:
        """Points that may face a direction that rounds to an axis (3,), which is within 45 degrees
        of it, and their normals."""
        key = tuple(axis.tolist())
        if key not in self._groups:
            most = np.arccos(-self._facing) + 0.25 * np.pi
            some = self._normals @ axis >= np.cos(min(most, np.pi)) * np.linalg.norm(axis) - 1e-9
            self._groups[key] = cKDTree(self._points[some]), self._normals[some]
        return self._groups[key]

    def _among(self, tree: cKDTree, normals, at, outward) -> np.ndarray:
        """(n,) distances from the nearest point of a tree that does not face away; infinite where
        all do."""
        out, left, k = np.full(len(at), np.inf), np.arange(len(at)), 1
        while len(left) and tree.n and k < 4 * tree.n:
            far, near = (x.reshape(len(left), -1) for x in tree.query(at[left], min(k, tree.n)))
            fits = np.einsum("nkj,nj->nk", normals[near], outward[left]) >= -self._facing
            first = far[np.arange(len(left)), fits.argmax(axis=1)]
            out[left] = np.where(fits.any(axis=1), first, np.inf)
            left, k = left[~fits.any(axis=1)], 4 * k
        return out


def _quarters(corners) -> np.ndarray:
    """(4 n, 3, 3) quarters of triangles (n, 3, 3), those of one after those of another."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    p, q, r = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = (a, p, r), (p, b, q), (r, q, c), (p, q, r)
    found = np.stack([np.stack(part, axis=1) for part in parts], axis=1)
    return np.asarray(found.reshape(-1, 3, 3))
