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
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner.known import Areas

# Parts of the strip beside a rim in which the surface is looked for.
_PARTS = 4


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
    rim_area : (k, s) float, length^2
        Area of the parts of the strip beside each of them, beyond the triangles.
    rim_deviation : (k, s) float, length
        Deviation of the surface there; infinite where it is not known.
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
    rim_deviation: np.ndarray
    rim_size: np.ndarray
    rim_slope: np.ndarray
    surface: Surface | None = None

    def areas(self, tolerance: float, law: PredictiveLaw, counted) -> "Areas":
        """Areas of the triangles and of the strips beside the rims ``counted`` (k,) bool, with
        what a law of errors says of a tolerance, length."""
        strip, beside = self.rim_area[counted].ravel(), self.rim_deviation[counted].ravel()
        known = np.isfinite(beside)
        area = np.append(self.area, strip[known])
        deviation = np.append(self.deviation, beside[known])
        away = np.append(self.away, np.zeros(known.sum()))
        return Areas(
            float(area @ law.chance(tolerance, deviation, away)),
            float(area @ PredictiveLaw().chance(tolerance, deviation, 0.0)),
            float(area.sum()),
            float(strip[~known].sum()),
        )

    def some(self, points, rims) -> "Places":
        """Those of the triangles ``points`` (n,) bool, and of the ``rims`` (k,) bool."""
        of = dict.fromkeys(("points", "normals", "deviation", "away", "area"), points)
        of |= dict.fromkeys((name for name in vars(self) if name.startswith("rim")), rims)
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
        none, no, parts = np.zeros((0, 3)), np.zeros(0), np.zeros((0, _PARTS))
        return Places(none, none, no, no, no, none, none, parts, parts, no, no)
    coarse = planning_cube(atlas)
    cube = coarse if cube is None else cube
    drawn = _drawn(body, cube)
    vertices, faces = drawn.vertices, drawn.faces
    ends, of, size, slope, enclosed = _ends(drawn)
    chord = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.linalg.norm(chord, axis=1)
    outward = _unit(drawn.normals[ends].sum(axis=1))
    onward = _unit(np.cross(chord, outward))
    middle = vertices[ends].mean(axis=1)
    # A surface in cubes ends within two of them of its rim.
    left = ~atlas.rims.at(middle, 2.0 * coarse)
    left &= ~body.beyond(middle, outward)
    if body.is_one_face:
        large = np.flatnonzero(size > LARGEST * body.extent)
        left[large] &= _are_open(body, middle[large], cube * onward[large], of[large])
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    double, normals = np.linalg.norm(normals, axis=1), _unit(normals)
    middles = vertices[faces].mean(axis=1)
    within = ~body.beyond(middles, normals)
    # Half of what is believed across, or the part of a round hole: a fourth of rim times diameter.
    width = np.minimum(0.5 * body.reach, 0.25 * size)
    beside = _beside(body, middle, width[:, None] * onward)
    strip = _strips(width * length, np.isfinite(beside), of, enclosed)
    return Places(
        middles[within],
        normals[within],
        np.maximum(drawn.deviation[faces].mean(axis=1), body.misses(middles))[within],
        body.away(middles[within]),
        0.5 * double[within],
        middle[left],
        outward[left],
        strip[left],
        beside[left],
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


def _ends(drawn: Surface) -> tuple[np.ndarray, ...]:
    """The edges (k, 2) at which a surface ends, and of all that hang together their number (k,),
    the diagonal (k,) of their bounding box, length, the slope (k,) at which the surface ends, and
    the area (k,), length^2, that they enclose."""
    vertices, faces = drawn.vertices, drawn.faces
    ends = igl.boundary_facets(faces)[0] if len(faces) else np.zeros((0, 2), int)
    ends = np.reshape(ends, (-1, 2))
    count = len(vertices)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), (count, count))
    of = connected_components(graph, directed=False)[1][ends[:, 0]]
    size, slope, enclosed = np.zeros((3, len(ends)))
    for number in np.unique(of).tolist():
        mine = of == number
        rim = np.unique(ends[mine])
        size[mine] = box_diagonal(vertices[rim])
        slope[mine] = slope_of_rim(vertices[rim], drawn.normals[rim])
        enclosed[mine] = _enclosed(*vertices[ends[mine]].transpose(1, 0, 2))
    return ends, of, size, slope, enclosed


def _enclosed(start, end) -> float:
    """Area, length^2, that the edges from ``start`` (k, 3) to ``end`` (k, 3) of closed curves
    enclose: the length of its vector, half of the sum of the cross products (Stokes)."""
    middle = start.mean(axis=0)
    return float(0.5 * np.linalg.norm(np.cross(start - middle, end - middle).sum(axis=0)))


def _are_open(body: Body, rim, away, of) -> np.ndarray:
    """(k,) whether the openings ``of`` (k,) int, to which the middles of rims (k, 3) belong, are
    real: whether the surface is unknown at more than a twentieth of the places beyond them, at
    multiples of ``away`` (k, 3), length, along the surface. Cubes are too coarse for a thin wall
    or a bend elsewhere."""
    known = np.zeros(len(rim))
    for step in (1.0, 1.5, 2.0):
        beyond = rim + step * away
        distance, normal = body.field.level(beyond)
        known += body.at(beyond - distance[:, None] * normal)[1] / 3.0
    of = np.unique(of, return_inverse=True)[1]
    return np.asarray((np.bincount(of, known) / np.bincount(of))[of] < 0.95)


def _strips(area, known, of, enclosed) -> np.ndarray:
    """(k, s) areas, length^2, of the parts of strips of an area (k,), of which some are ``known``
    (k, s) bool. Strips overlap in a narrow hole: what is known of the hole ``of`` (k,) int is no
    more than the area (k,) ``enclosed`` by its rim."""
    parts = np.repeat(area[:, None] / _PARTS, _PARTS, axis=1)
    total = np.bincount(of, (parts * known).sum(axis=1))[of]
    share = np.divide(enclosed, total, out=np.ones(len(total)), where=total > enclosed)
    return np.asarray(parts * np.where(known, share[:, None], 1.0))


def _beside(body: Body, rim, across) -> np.ndarray:
    """(k, s) deviations, length, of the surface in parts of the strips that go from the middles of
    rims (k, 3) as far as ``across`` (k, 3), length; infinite where it is not known."""
    parts = (np.arange(_PARTS) + 0.5) / _PARTS
    beyond = (rim[:, None] + parts[:, None] * across[:, None]).reshape(-1, 3)
    distance, normal = body.field.level(beyond)
    found, known = body.at(beyond - distance[:, None] * normal)
    return np.where(known, found.deviation, np.inf).reshape(-1, _PARTS)


def _unit(vectors) -> np.ndarray:
    """(n, 3) unit vectors along vectors (n, 3), or zero."""
    length = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny)[:, None])
