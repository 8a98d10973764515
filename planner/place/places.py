"""Places: where the surface of a body is known, how well, and where it ends."""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.special import erf

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.contouring.body_surface import (
    WITHIN_REACH,
    body_surface,
    coarse_edge,
    is_smooth,
)
from touchatlas.atlas.mesh.close_holes import LARGEST, diameter, error_across, slope_of_rim
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces
from touchatlas.atlas.records.surface import Surface
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner.place.deviation_ratio import DeviationRatio

# Width of the unknown strip that an open rim stands for, over the distance across which laws are
# believed. Doubled, a surface with small holes counts as less known.
_STRIP = 0.5
# Area of a round hole over the product of its rim and its diameter. Doubled, small holes count
# twice.
_OF_HOLE = 0.25
# Edge of the cubes of a free-form body over those that show its shape, and most cubes along its
# extent. The first doubled, planning takes a fourth of the time, and small holes are found late;
# the second, it takes four times as long, and both sides of thinner walls are seen.
_ROUGH, _FINEST = 4.0 / 3.0, 64
# Distance from a rim at which a surface in cubes ends there, in edges of the cubes. Doubled, more
# of what no contour crossed counts as the opening.
_AT_RIM = 2.0
# Distances beyond the rim of an opening at which the surface is asked for, in edges of the cubes,
# and share of these places at which it is known, from which the opening is none: cubes are too
# coarse for a thin wall or a bend there. Of 103 openings of four bodies 33 had such a share: all
# but one at most 6 % of the unknown surface that their rims stand for; others had up to half of it.
# At 0.9 it was up to 12 %. With the distances doubled, the other side of narrow openings is met.
_BEYOND, _KNOWN = (1.0, 1.5, 2.0), 0.95
# Distance between places that are listed at the end, in extents. Doubled, fewer places are named.
_LISTED = 0.1


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the surface of a body, and of its open rims.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
        Middles of triangles.
    deviation : (n,) float, length
    area : (n,) float, length^2
    rim, rim_normals : (k, 3) float, length; unit, world
        Middles of the edges at which the surface ends.
    rim_area : (k,) float, length^2
        Area beside each of them that is taken to be unknown.
    rim_size : (k,) float, length
        Diagonal of the bounding box of the hole or opening that each is of.
    rim_slope : (k,) float
        Sine of the angle at which the surface meets the plane across it.
    """

    points: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    area: np.ndarray
    rim: np.ndarray
    rim_normals: np.ndarray
    rim_area: np.ndarray
    rim_size: np.ndarray
    rim_slope: np.ndarray

    def areas(self, tolerance: float, ratio: DeviationRatio, counted) -> tuple[float, float, float]:
        """Expected area within a tolerance; all area, with that beside the rims ``counted`` (k,)
        bool; and the first by predicted deviations alone, length^2."""
        limit = tolerance / np.maximum(self.deviation, np.finfo(float).tiny)
        inside = float((self.area * ratio.within(limit)).sum())
        unscaled = float((self.area * erf(limit / np.sqrt(2.0))).sum())
        return inside, float(self.area.sum() + self.rim_area[counted].sum()), unscaled

    def left(self, tolerance: float, extent: float) -> np.ndarray:
        """(m, 3) places that are open or not known to a tolerance, far apart from each other for a
        body of an extent, length, world."""
        weak = self.points[SURE * self.deviation > tolerance]
        return _apart_from_each_other(np.concatenate([self.rim, weak]), extent)

    def are_large(self, extent: float) -> np.ndarray:
        """(k,) whether each rim is of an opening that is too large for a body of an extent, length,
        to be closed across."""
        return np.asarray(self.rim_size > LARGEST * extent)

    def stay_open(self, tolerance: float, extent: float) -> np.ndarray:
        """(k,) whether each rim is of a hole that is not closed within a tolerance. The middle of a
        hole is taken to be half of its size away from what is known: of a round one, by 1.4 of its
        radius. Large openings stay open."""
        error = error_across(0.5 * self.rim_size, self.rim_slope)
        return np.asarray((error > tolerance) | self.are_large(extent))


def places_of(atlas: Atlas, edge: float | None = None) -> Places:
    """The places of the body of an atlas, from its surface in cubes of an edge, length; a coarse
    one, if none is given. Finer ones show smaller holes.

    Openings of the body at which contact was lost are no rims that are left to touch.
    """
    body = atlas.body
    if body is None:
        none, no = np.zeros((0, 3)), np.zeros(0)
        return Places(none, none, no, no, none, none, no, no, no)
    edge = planning_edge(atlas) if edge is None else edge
    drawn = _drawn(body, edge)
    vertices, faces = drawn.vertices, drawn.faces
    ends, of, size, slope = _ends(drawn)
    chord = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.linalg.norm(chord, axis=1)
    outward = _unit(drawn.normals[ends].sum(axis=1))
    middle = vertices[ends].mean(axis=1)
    left = ~atlas.rims.at(middle, _AT_RIM * planning_edge(atlas))
    left &= ~body.beyond(middle, outward)
    if is_smooth(body):
        large = np.flatnonzero(size > LARGEST * body.extent)
        away = edge * _unit(np.cross(chord[large], outward[large]))
        left[large] &= _are_open(body, middle[large], away, of[large])
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    double, normals = np.linalg.norm(normals, axis=1), _unit(normals)
    middles = vertices[faces].mean(axis=1)
    within = ~body.beyond(middles, normals)
    return Places(
        middles[within],
        normals[within],
        drawn.deviation[faces].mean(axis=1)[within],
        0.5 * double[within],
        middle[left],
        outward[left],
        (np.minimum(_STRIP * body.reach, _OF_HOLE * size) * length)[left],
        size[left],
        slope[left],
    )


def planning_edge(atlas: Atlas) -> float:
    """Edge of the cubes that show where the body of an atlas is known, length."""
    if atlas.body is None:
        raise ValueError("the atlas has no body; add a touch first")
    body, edge = atlas.body, coarse_edge(atlas.body)
    if not atlas.known_body.is_one:
        return edge
    return max(min(_ROUGH * edge, WITHIN_REACH * body.reach), body.extent / _FINEST)


def _drawn(body: Body, edge: float) -> Surface:
    """The surface of a body in cubes of an edge, length, without stray pieces and curvatures."""
    drawn = body_surface(body, edge)
    return without_stray_pieces(drawn, body.samples.points) if is_smooth(body) else drawn


def _ends(drawn: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The edges (k, 2) at which a surface ends, and of all that hang together their number (k,),
    the diagonal (k,) of their bounding box, length, and the slope (k,) at which the surface ends.
    """
    vertices, faces = drawn.vertices, drawn.faces
    ends = igl.boundary_facets(faces)[0] if len(faces) else np.zeros((0, 2), int)
    ends = np.reshape(ends, (-1, 2))
    count = len(vertices)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), (count, count))
    of = connected_components(graph, directed=False)[1][ends[:, 0]]
    size, slope = np.zeros((2, len(ends)))
    for number in np.unique(of).tolist():
        mine = of == number
        rim = np.unique(ends[mine])
        size[mine] = diameter(vertices[rim])
        slope[mine] = slope_of_rim(vertices[rim], drawn.normals[rim])
    return ends, of, size, slope


def _are_open(body: Body, rim, away, of) -> np.ndarray:
    """(k,) whether the openings ``of`` (k,) int, to which the middles of rims (k, 3) belong, are
    real: whether the surface is unknown beyond some of these, at multiples of ``away`` (k, 3),
    length, along the surface."""
    known = np.zeros(len(rim))
    for step in _BEYOND:
        beside = rim + step * away
        at = body.field.at(beside, texture=False)
        known += body.at(beside - at.distance[:, None] * at.normal, texture=False)[1]
    of = np.unique(of, return_inverse=True)[1]
    share = np.bincount(of, known / len(_BEYOND)) / np.bincount(of)
    return np.asarray(share[of] < _KNOWN)


def _unit(vectors) -> np.ndarray:
    """(n, 3) unit vectors along vectors (n, 3), or zero."""
    length = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny)[:, None])


def _apart_from_each_other(points, extent: float) -> np.ndarray:
    """(k, 3) the first of points (n, 3) that are far from each other."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(((point - other) ** 2).sum() > (_LISTED * extent) ** 2 for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)
