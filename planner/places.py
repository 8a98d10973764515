"""Places: where the surface of a body is known, how well, and where it ends."""

from dataclasses import dataclass, replace

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.mesh.mend import (
    LARGEST,
    diameter,
    error_across,
    slope_of_rim,
    without_stray_pieces,
)
from touchatlas.atlas.mesh.surface import (
    MOST,
    WITHIN_REACH,
    body_surface,
    coarse_edge,
)
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.predictive_law import PredictiveLaw
from touchatlas.patch.geometry.normal_error import SURE


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the surface of a body, and of its open rims.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
        Middles of triangles.
    deviation : (n,) float, length
    away : (n,) float, length
        Distance of each from the nearest sample.
    area : (n,) float, length^2
    rim, rim_normals : (k, 3) float, length; unit, world
        Middles of the edges at which the surface ends.
    rim_area : (k,) float, length^2
        Area beside each of them that is taken to be unknown.
    rim_size : (k,) float, length
        Diagonal of the bounding box of the hole or opening that each is of.
    rim_slope : (k,) float
        Sine of the angle at which the surface meets the plane across it.
    surface : Surface or None
        The triangles; None before the first touch that taught anything.
    """

    points: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    away: np.ndarray
    area: np.ndarray
    rim: np.ndarray
    rim_normals: np.ndarray
    rim_area: np.ndarray
    rim_size: np.ndarray
    rim_slope: np.ndarray
    surface: Surface | None = None

    def areas(self, tolerance: float, law: PredictiveLaw, counted) -> tuple[float, float, float]:
        """Expected area within a tolerance by a law of errors; all area, with that beside the rims
        ``counted`` (k,) bool; and the first by the law that comes before all samples, length^2."""
        inside = float(self.area @ law.chance(tolerance, self.deviation, self.away))
        unscaled = float(self.area @ PredictiveLaw().chance(tolerance, self.deviation, 0.0))
        return inside, float(self.area.sum() + self.rim_area[counted].sum()), unscaled

    def some(self, points, rims) -> "Places":
        """Those of the triangles ``points`` (n,) bool, and of the ``rims`` (k,) bool."""
        of = dict.fromkeys(("points", "normals", "deviation", "away", "area"), points)
        of |= dict.fromkeys(("rim", "rim_normals", "rim_area", "rim_size", "rim_slope"), rims)
        return replace(self, **{name: getattr(self, name)[which] for name, which in of.items()})

    @property
    def all(self) -> tuple[np.ndarray, np.ndarray]:
        """Middles (n, 3) of rims, then of triangles, length, and their normals (n, 3)."""
        return (
            np.concatenate([self.rim, self.points]),
            np.concatenate([self.rim_normals, self.normals]),
        )

    def left(self, tolerance: float, law: PredictiveLaw, apart: float) -> np.ndarray:
        """(m, 3) places that are open or not known to a tolerance by a law of errors, farther from
        each other than ``apart``, length, world."""
        vague = self.points[SURE * law.deviations(self.deviation) > tolerance]
        kept: list[np.ndarray] = []
        for point in np.concatenate([self.rim, vague]):
            if all(((point - other) ** 2).sum() > apart**2 for other in kept):
                kept.append(point)
        return np.reshape(kept, (-1, 3))

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


def places_of(atlas: Atlas, cube: float | None = None) -> Places:
    """The places of the body of an atlas, from its surface in cubes of a size, length; coarse ones,
    if none is given. Finer ones show smaller holes.

    Openings of the body at which contact was lost are no rims that are left to touch.
    """
    body = atlas.body
    if body is None:
        none, no = np.zeros((0, 3)), np.zeros(0)
        return Places(none, none, no, no, no, none, none, no, no, no)
    coarse = planning_cube(atlas)
    cube = coarse if cube is None else cube
    drawn = _drawn(body, cube)
    vertices, faces = drawn.vertices, drawn.faces
    ends, of, size, slope = _ends(drawn)
    chord = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.linalg.norm(chord, axis=1)
    outward = _unit(drawn.normals[ends].sum(axis=1))
    middle = vertices[ends].mean(axis=1)
    # A surface in cubes ends within two of them of its rim.
    left = ~atlas.rims.at(middle, 2.0 * coarse)
    left &= ~body.beyond(middle, outward)
    if body.is_one_face:
        large = np.flatnonzero(size > LARGEST * body.extent)
        away = cube * _unit(np.cross(chord[large], outward[large]))
        left[large] &= _are_open(body, middle[large], away, of[large])
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    double, normals = np.linalg.norm(normals, axis=1), _unit(normals)
    middles = vertices[faces].mean(axis=1)
    within = ~body.beyond(middles, normals)
    # Half of what is believed across, or the part of a round hole: a fourth of rim times diameter.
    strip = np.minimum(0.5 * body.reach, 0.25 * size) * length
    return Places(
        middles[within],
        normals[within],
        drawn.deviation[faces].mean(axis=1)[within],
        body.away(middles[within]),
        0.5 * double[within],
        middle[left],
        outward[left],
        strip[left],
        size[left],
        slope[left],
        drawn,
    )


def _drawn(body: Body, cube: float) -> Surface:
    """The surface of a body in cubes of a size, length, without stray pieces. Where nothing is
    drawn, as of a strip that is narrower than the cubes, these are halved."""
    drawn = body_surface(body, cube)
    while not len(drawn.faces) and cube > body.extent / MOST:
        cube *= 0.5
        drawn = body_surface(body, cube)
    return without_stray_pieces(drawn, body.samples.points) if body.is_one_face else drawn


def planning_cube(atlas: Atlas) -> float:
    """Size of the cubes that show where the body of an atlas is known, length. Those of a free-form
    body are by a third larger than those that show its shape, and at most 64 along its extent."""
    if atlas.body is None:
        raise ValueError("the atlas has no body; add a touch first")
    body, cube = atlas.body, coarse_edge(atlas.body)
    if not body.is_one_face:
        return cube
    return max(min(4.0 / 3.0 * cube, WITHIN_REACH * body.reach), body.extent / 64)


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
    real: whether the surface is unknown at more than a twentieth of the places beyond them, at
    multiples of ``away`` (k, 3), length, along the surface. Cubes are too coarse for a thin wall
    or a bend elsewhere."""
    known = np.zeros(len(rim))
    for step in (1.0, 1.5, 2.0):
        beyond = rim + step * away
        at = body.field.at(beyond)
        known += body.at(beyond - at.distance[:, None] * at.normal)[1] / 3.0
    of = np.unique(of, return_inverse=True)[1]
    return np.asarray((np.bincount(of, known) / np.bincount(of))[of] < 0.95)


def _unit(vectors) -> np.ndarray:
    """(n, 3) unit vectors along vectors (n, 3), or zero."""
    length = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny)[:, None])
