"""Close slits: holes that are narrow everywhere are closed from side to side.

A surface that leaves one side of a slit and comes back at the other goes round between them: at the
crest of a thin wall it rises by half of the slit's width, and where the sides are level by little.
So a narrow slit may be closed within the tolerance, and needs no touch then.
"""

import igl
import numpy as np

from touchatlas.atlas.mesh.close_holes import LARGEST, diameter
from touchatlas.atlas.mesh.triangles_across import Across, edges_within, triangles_across
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.rims import Rims
from touchatlas.patch.geometry.normal_error import SURE


def close_slits(surface: Surface, rims: Rims) -> Surface:
    """The surface with triangles across each hole that they close without a new edge longer than
    ``LARGEST`` of the diagonal of its piece.

    New edges are bent: there is a vertex at the middle of each. Openings of the body, whose middles
    lie beyond ``rims``, stay open. The surface must be manifold.
    """
    points, normals = surface.vertices, surface.normals
    loops = [np.array(loop) for loop in igl.boundary_loop_all(surface.faces)]
    piece = igl.vertex_components(surface.faces) if loops else np.zeros(0, int)
    parts: list[Surface] = []
    faces, places, count = [surface.faces], [], len(points)
    for loop, edges in zip(loops, edges_within(surface.faces, loops), strict=True):
        longest = LARGEST * diameter(points[piece == piece[loop[0]]])
        across = triangles_across(points[loop], normals[loop], edges, longest)
        if across is None:
            continue
        middles = _middles(surface, loop, across)
        if rims.beyond(middles.vertices, middles.normals).any():
            continue
        numbers = np.concatenate([loop, count + np.arange(len(middles.vertices))])
        faces.append(numbers[_halved(across)])
        parts.append(middles)
        places.append(across.widest(points[loop]))
        count += len(middles.vertices)
    if not parts:
        return surface
    return surface.extended(parts, np.concatenate(faces), np.array(places))


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
    number = {frozenset(edge): i for i, edge in enumerate(across.diagonals.tolist())}
    total = np.zeros((len(number), 3))
    for triangle, normal in zip(across.triangles.tolist(), normals, strict=True):
        for i in range(3):
            if (edge := number.get(frozenset((triangle[i - 1], triangle[i])))) is not None:
                total[edge] += normal
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
