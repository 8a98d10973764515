"""Mend: stray pieces are left out, rims end where contact was lost, and holes are closed.

A surface that leaves one side of a hole and comes back at the other goes round between them: at the
crest of a thin wall it rises by half of the hole's width, and where the sides are level by little.
So a narrow hole may be closed within the tolerance, and needs no touch then.
"""

from dataclasses import dataclass, replace
from heapq import heapify, heappop, heappush

import igl
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.rims import Rims
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.geometry.normal_error import SURE

# Longest edge across a hole that is closed, and diagonal of the bounding box of the smallest piece
# that stays, over that of its piece and of the surface: longer openings may be true. The planner
# touches smaller holes last.
LARGEST = 0.1
# Expected deviation of an unknown surface, in distances to the known one: a slope of six degrees.
_SLOPE = 0.1
# Least mean cosine between the normals of a hole's triangles and those of its rim: 120 degrees. At
# the crest of a wall it is 0, about the outer rim of what was touched -1.
_LEAST_COSINE = -0.5


def without_stray_pieces(surface: Surface, samples, least: float = LARGEST) -> Surface:
    """The surface without stray pieces, and their number.

    Between samples the field may have another zero beside the surface. A piece there is no
    sample's nearest, or it is small. The one of the largest area stays.

    Parameters
    ----------
    surface : Surface
    samples : (n, 3) float, length, world
        Points on the body.
    least : float
        Diagonal of the bounding box of a piece, over that of the surface, below which it is small.
    """
    piece = igl.vertex_components(surface.faces) if len(surface.faces) else np.zeros(0, int)
    count = int(piece.max(initial=-1)) + 1
    if count < 2:
        return surface
    points = surface.vertices
    nearest = piece[cKDTree(points).query(samples)[1]]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, piece, points)
    np.maximum.at(high, piece, points)
    stray = np.linalg.norm(high - low, axis=1) < least * box_diagonal(points)
    stray |= np.bincount(nearest, minlength=count) == 0
    area = np.bincount(piece[surface.faces[:, 0]], igl.doublearea(points, surface.faces), count)
    stray[area.argmax()] = False
    if not stray.any():
        return surface
    strays = surface.stray_pieces + int(stray.sum())
    return replace(surface.only(~stray[piece]), stray_pieces=strays)


def ended_at_rims(surface: Surface, body: Body) -> Surface:
    """The surface without the triangles beyond rims; the vertices beyond of triangles across a rim
    are moved onto it."""
    if not (body.rims and len(surface.faces)):
        return surface
    points, faces = surface.vertices, surface.faces
    beyond = body.beyond(points, surface.normals)
    across = ~beyond[faces].all(axis=1)
    moved = np.intersect1d(faces[across], np.flatnonzero(beyond))
    onto = body.rims.onto(points[moved], surface.normals[moved])
    # On the tangent plane they left the surface by the sagitta of the way.
    found = body.field.at(onto)
    points = points.copy()
    points[moved] = onto - found.distance[:, None] * found.normal
    return replace(surface, vertices=points).of(faces[across])


def error_across(half, sine) -> np.ndarray:
    """Error of a surface in the middle of a gap, exceeded once in twenty, length: at a distance
    ``half``, length, from its ends, where the surface meets the gap at an angle of a ``sine``.

    A circle that meets the gap at angles t rises above its middle by half of the gap times
    tan(t / 2) = sin t / (1 + cos t). Angles are at most right ones, and of any surface a slope of
    a tenth is expected.
    """
    sine = np.minimum(np.abs(sine), 1.0)
    rise = sine / (1.0 + np.sqrt(1.0 - sine * sine))
    return np.asarray(half * np.maximum(SURE * _SLOPE, rise))


def slope_of_rim(points, normals) -> float:
    """Mean sine of the angles at which a surface with normals (n, 3) meets the plane across a hole,
    at points (n, 3) of its rim: 0 on a plane or a saddle, 1 at the end of a tube, -1 at the bottom
    of a bore."""
    offset = points - points.mean(axis=0)
    away = np.sqrt((offset * offset).sum(axis=1))
    sines = np.einsum("ij,ij->i", normals, offset) / np.maximum(away, np.finfo(float).tiny)
    return float(sines.mean())


def close_holes(surface: Surface, rims: Rims) -> Surface:
    """The surface with triangles across each hole that they close without a new edge longer than
    ``LARGEST`` of the diagonal of its piece.

    New edges are bent: there is a vertex at the middle of each. Openings of the body, whose middles
    lie beyond ``rims``, stay open.
    """
    points, normals = surface.vertices, surface.normals
    loops = [np.array(k) for k in igl.boundary_loop_all(surface.faces)] if len(points) else []
    piece = igl.vertex_components(surface.faces) if loops else np.zeros(0, int)
    sizes = {k: box_diagonal(points[piece == k]) for k in {int(piece[loop[0]]) for loop in loops}}
    parts: list[Surface] = []
    faces, places, count = [surface.faces], [], len(points)
    for loop, edges in zip(loops, _edges_within(surface.faces, loops), strict=True):
        longest = LARGEST * sizes[int(piece[loop[0]])]
        across = triangles_across(points[loop], normals[loop], edges, longest)
        if across is None:
            continue
        middles = _middles(surface, loop, across)
        if rims.beyond(middles.vertices, middles.normals).any():
            continue
        numbers = np.concatenate([loop, count + np.arange(len(middles.vertices))])
        faces.append(numbers[_halved(across)])
        parts.append(middles)
        widest = middles.vertices[across.error.argmax()] if len(across.error) else None
        places.append(points[loop].mean(axis=0) if widest is None else widest)
        count += len(middles.vertices)
    if not parts:
        return surface
    return surface.extended(parts, np.concatenate(faces), np.array(places))


def _edges_within(faces, loops) -> list[np.ndarray]:
    """For each loop the edges (m, 2) of triangles (f, 3) that join two of its vertices, which are
    counted along it. No vertex is in two loops."""
    if not loops:
        return []
    label = np.full(int(faces.max()) + 1, -1)
    place = np.zeros(len(label), int)
    for number, loop in enumerate(loops):
        label[loop], place[loop] = number, np.arange(len(loop))
    edges = igl.edges(faces)
    first, second = label[edges].T
    inner = edges[(first >= 0) & (first == second)]
    return [place[inner[label[inner[:, 0]] == number]] for number in range(len(loops))]


@dataclass(frozen=True, eq=False)
class Across:
    """Triangles from side to side of a hole.

    Parameters
    ----------
    triangles : (n - 2, 3) int
        Points of the rim, which are counted along it.
    diagonals : (n - 3, 2) int
        Edges of the triangles that are inside the rim.
    error : (n - 3,) float, length
        That of the surface at the middle of each, exceeded once in twenty.
    """

    triangles: np.ndarray
    diagonals: np.ndarray
    error: np.ndarray


def triangles_across(rim, normals, edges, longest: float = np.inf) -> Across | None:
    """Triangles across a hole with a rim (n, 3) and normals (n, 3) there; None where one of their
    edges is longer than ``longest``, length, or is among the edges (m, 2) that its points have
    already, and where they face away from the surface at a rim that is longer than that: it is the
    outer rim of a strip. At a shorter one two ends of the surface overlap a little.

    Corners of the rim are cut off one after another, that of the smallest circle through its three
    points first. So the triangles are as wide as the slit, and advance from its ends. Corners that
    point into the hole come later: a triangle there lies on the surface, and faces the other way.
    """
    count = len(rim)
    before, after = np.roll(np.arange(count), 1).tolist(), np.roll(np.arange(count), -1).tolist()
    taken = {frozenset(edge) for edge in np.asarray(edges).tolist()}
    triangles: list[tuple[int, int, int]] = []
    diagonals: list[tuple[int, int]] = []

    def corner(i: int) -> tuple[float, int, int, int]:
        a, b = before[i], after[i]
        three = [b, i, a]
        is_free = np.linalg.norm(rim[b] - rim[a]) <= longest and frozenset((a, b)) not in taken
        points_in = _mean_cosine(rim[[three]], normals[[three]]) < _LEAST_COSINE
        radius = (2.0 if points_in else 1.0) * _circumradius(rim[three])
        return (radius if is_free else np.inf), i, a, b

    waiting = [corner(i) for i in range(count)]
    heapify(waiting)
    while len(triangles) < count - 3:
        radius, i, a, b = heappop(waiting)
        if (before[i], after[i]) != (a, b):
            continue
        if not radius < np.inf:
            return None
        triangles.append((b, i, a))
        diagonals.append((a, b))
        taken.add(frozenset((a, b)))
        after[a], before[b], after[i] = b, a, -1
        heappush(waiting, corner(a))
        heappush(waiting, corner(b))
    last = next(i for i in range(count) if after[i] >= 0)
    found = np.array([*triangles, (after[last], last, before[last])])
    faces_away = not _mean_cosine(rim[found], normals[found]) >= _LEAST_COSINE
    if faces_away and not box_diagonal(rim) <= longest < np.inf:
        return None
    ends = np.array(diagonals, int).reshape(-1, 2)
    gap = rim[ends[:, 1]] - rim[ends[:, 0]]
    length = np.maximum(np.linalg.norm(gap, axis=1), np.finfo(float).tiny)
    sine = np.abs(np.einsum("mkj,mj->mk", normals[ends], gap)).max(axis=1, initial=0.0) / length
    return Across(found, ends, error_across(0.5 * length, sine))


def _mean_cosine(triangles, normals) -> float:
    """Mean over the area of triangles (t, 3, 3) of the cosine between their normals and those at
    their corners (t, 3, 3)."""
    a, b, c = triangles.transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    total = np.linalg.norm(across, axis=1).sum()
    return float((across * normals.mean(axis=1)).sum() / max(total, np.finfo(float).tiny))


def _circumradius(triangle) -> float:
    """Radius of the circle through three points (3, 3), length: a b c / (4 area)."""
    a, b, c = triangle
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a)))
    sides = float(np.linalg.norm(b - a) * np.linalg.norm(c - b) * np.linalg.norm(a - c))
    return sides / (4.0 * area) if area > 0.0 else np.inf


def _middles(surface: Surface, loop, across: Across) -> Surface:
    """The vertices at the middles of new edges, without triangles.

    An edge is the cubic that is perpendicular to the normals at its ends (Vlachos and others,
    Curved PN triangles, 2001). On a sphere its middle is off by the fourth power of its length.
    """
    edges = loop[across.diagonals]
    (a, b), (u, v) = (x[edges].transpose(1, 0, 2) for x in (surface.vertices, surface.normals))
    rise = ((b - a) * u).sum(axis=1)[:, None] * u - ((b - a) * v).sum(axis=1)[:, None] * v
    return Surface(
        0.5 * (a + b) - rise / 8.0,
        np.zeros((0, 3), int),
        _normals_of_edges(surface.vertices[loop], across),
        np.hypot(surface.deviation[edges].max(axis=1, initial=0.0), across.error / SURE),
        surface.patch[edges[:, 0]],
        surface.gaussian_curvature[edges].mean(axis=1),
    )


def _normals_of_edges(rim, across: Across) -> np.ndarray:
    """(m, 3) unit normals of new edges: the mean of those of the triangles at both sides. At the
    crest of a wall the normals of the rim are opposed, and tell nothing."""
    normals = igl.per_face_normals(np.asarray(rim), across.triangles, np.zeros(3))
    sides = np.stack([across.triangles, np.roll(across.triangles, -1, axis=1)], axis=2)
    same = (np.sort(sides)[..., None, :] == np.sort(across.diagonals)).all(axis=-1).any(axis=1)
    total = same.T.astype(float) @ normals
    length = np.linalg.norm(total, axis=1)
    # Of triangles that lie on each other one is taken.
    total[length == 0.0] = normals[0]
    return np.asarray(total / np.where(length > 0.0, length, 1.0)[:, None])


def _halved(across: Across) -> np.ndarray:
    """(t, 3) the triangles with their inner edges halved; the middles are counted after the rim."""
    count = len(across.triangles) + 2
    middle = {frozenset(edge): count + i for i, edge in enumerate(across.diagonals.tolist())}
    faces = []
    for a, b, c in across.triangles.tolist():
        sides = ((a, b), (b, c), (c, a))
        ring = [
            p for side in sides for p in (side[0], middle.get(frozenset(side))) if p is not None
        ]
        # The fan begins at a middle: the sides of the rim are not halved, and three points of one
        # side are no triangle.
        first = next((i for i, p in enumerate(ring) if p >= count), 0)
        ring = ring[first:] + ring[:first]
        faces += [(ring[0], p, q) for p, q in zip(ring[1:-1], ring[2:], strict=True)]
    return np.array(faces)
