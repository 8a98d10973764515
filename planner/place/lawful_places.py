"""LawfulPlaces: where the surface of a body whose faces obey laws is known, and where it ends."""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.spatial import cKDTree
from scipy.special import erf

from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.lawful_surface import coarse_edge, lawful_triangles
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner.place.choose import APART_HOLES, Target, View, best_open
from touchatlas.planner.place.deviation_ratio import DeviationRatio
from touchatlas.planner.probe_plan import Reason

# Width of the unknown strip that an open rim stands for, over the distance across which laws are
# believed. Doubled, a surface with small holes counts as less known.
_STRIP = 0.5
# Distance about a touch within which it takes most of the variance, in extents. Doubled, touches go
# amid what is vague rather than where it is vaguest.
_ABOUT = 0.1


@dataclass(frozen=True, eq=False)
class LawfulPlaces:
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
    """

    points: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    area: np.ndarray
    rim: np.ndarray
    rim_normals: np.ndarray
    rim_area: np.ndarray

    def areas(self, tolerance: float, ratio: DeviationRatio, untried) -> tuple[float, float, float]:
        """Expected area within a tolerance, all area, and the first by predicted deviations alone,
        length^2; ``untried`` (k,) are the rims that count."""
        limit = tolerance / np.maximum(self.deviation, np.finfo(float).tiny)
        inside = float((self.area * ratio.within(limit)).sum())
        unscaled = float((self.area * erf(limit / np.sqrt(2.0))).sum())
        return inside, float(self.area.sum() + self.rim_area[untried].sum()), unscaled

    def left(self, tolerance: float) -> np.ndarray:
        """(m, 3) places that are open or not known to a tolerance, length, world."""
        return np.concatenate([self.rim, self.points[SURE * self.deviation > tolerance]])


def rim_target(view: View, places: LawfulPlaces) -> Target | None:
    """Where the surface ends, far from all touches. None where all of that is near touches or
    attempts."""
    free = np.flatnonzero(view.is_free(places.rim))
    if not len(free):
        # What is left of the rims are small holes, which may lie beside a touch.
        free = np.flatnonzero(view.apart(places.rim) > APART_HOLES * view.extent)
    if not len(free):
        return None
    best = free[best_open(view, places.rim[free])]
    return Target(places.rim[best], places.rim_normals[best], Reason.EXPAND)


def weak_target(view: View, places: LawfulPlaces) -> Target | None:
    """The place about which a touch can take most of what the tolerance does not bear: the integral
    of the variance. None where all such places are near touches or attempts."""
    weak = SURE * view.places.deviation_ratio.value * places.deviation > view.atlas.tolerance
    asked = np.flatnonzero(weak & view.is_free(places.points))
    if not len(asked):
        return None
    gain = np.where(weak, places.area * places.deviation**2, 0.0)
    tree = cKDTree(places.points)
    near = tree.query_ball_point(places.points[asked], _ABOUT * view.extent)
    sums = [gain[some].sum() for some in near]
    best = asked[int(np.argmax(sums))]
    return Target(places.points[best], places.normals[best], Reason.REFINE)


def lawful_places(body: LawfulBody, edge: float | None = None) -> LawfulPlaces:
    """The places of a body, from its surface in cubes of an edge, length; a coarse one, if
    none is given. Finer ones show smaller holes.
    """
    edge = coarse_edge(body) if edge is None else edge
    vertices, faces, found = lawful_triangles(body, edge)
    ends = igl.boundary_facets(faces)[0] if len(faces) else np.zeros((0, 2), int)
    ends = np.reshape(ends, (-1, 2))
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    outward = found.normal[ends].sum(axis=1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1), np.finfo(float).tiny)[:, None]
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    double = np.linalg.norm(normals, axis=1)
    return LawfulPlaces(
        vertices[faces].mean(axis=1),
        normals / np.maximum(double, np.finfo(float).tiny)[:, None],
        found.deviation[faces].mean(axis=1),
        0.5 * double,
        vertices[ends].mean(axis=1),
        outward,
        _STRIP * body.reach * length,
    )
