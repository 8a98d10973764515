"""Refine: edges of triangles are halved until the triangles are near enough to the surface.

How high the surface rises over an edge follows from the normals at its ends: it is the cubic curve
through them. Where patches disagree a little, the normals do not tell all, and the field is asked
at the middles of long edges. Two triangles share what becomes of their edge, so no gap opens.
"""

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.known_surface import whole_field
from touchatlas.atlas.mesh.coarse_mesh import CoarseMesh, Vertices, project
from touchatlas.atlas.mesh.narrow_band import REACH
from touchatlas.atlas.mesh.trim import supported
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState

# Most times that an edge is halved: its height is then a 4,000th. Doubled, folds between patches
# that disagree fill with triangles.
_HALVINGS = 6
# Side of the cubes whose triangles the surface ends in, in edges that resolve the patches, beyond
# which these are halved. Doubled, rims are ragged by twice as much.
_LONG = 1.2
# Length of an edge from which on the field is asked about its middle, in edges of the cubes. What
# normals do not tell falls with its square. Doubled, about half of the edges are not asked.
_ASKED = 0.5
# Distance from a long edge from which on the field is asked, in bounds. Doubled, surfaces near the
# bound are beyond it in places.
_DOUBTED = 0.4
# Largest height over an edge, in bounds: vertices are moved out by the mean of the heights about
# them, and that is less than the largest. Doubled, vertices are farther than the bound.
_MOVED = 1.25
# Bound in predicted deviations, where that is more. Doubled, half as many triangles where little is
# known.
_UNSURE = 0.1
# Least cosine between the normals of an edge's end and middle from which its height is computed.
# Doubled, to 1, curved edges start lower.
_LEVEL = 0.5


def refine(
    state: AtlasState, mesh: CoarseMesh, bound: float, edge: float, halvings: int = 0
) -> tuple[CoarseMesh, np.ndarray]:
    """A mesh whose edges are within a bound of the surface, and what of it is to be drawn.

    Parameters
    ----------
    state : AtlasState
    mesh : CoarseMesh
    bound : float, length
        Largest distance of the surface from an edge that is drawn, when its ends are
        moved out (``vertex_heights``). Where the surface is not sure it is a tenth of the
        predicted deviation, if that is more.
    edge : float, length
        Typical edge where the surface ends.
    halvings : int
        Times that every edge is halved.

    Returns
    -------
    mesh : CoarseMesh
        The vertices of the coarse one come first.
    drawn : (v,) bool
        Whether the surface is known at a vertex and supported by samples.
    """
    vertices, faces, asked = mesh.vertices, mesh.faces, np.zeros(0, np.int64)
    drawn, field, long = _drawn(state, vertices), whole_field(state), _ASKED * mesh.edge
    for done in range(max(halvings, _HALVINGS)):
        ends, sides = edges_of(faces)
        first, second = vertices.points[ends.T]
        length = np.sqrt(((second - first) ** 2).sum(axis=1))
        inside = drawn[ends].all(axis=1)
        at_end = np.zeros(len(ends), bool)
        if mesh.edge > _LONG * edge * 2**done:
            at_end[sides[drawn[faces].any(axis=1) & ~drawn[faces].all(axis=1)]] = True
        some = inside & _on_sheet(vertices, ends)
        far, asked = _far(field, vertices, ends, some, length > long, bound, mesh.edge, asked)
        halved = far | at_end | (done < halvings)
        if not halved.any():
            break
        middle = np.full(len(ends), -1)
        middle[halved] = len(drawn) + np.arange(halved.sum())
        sure = inside & (length <= long)
        new = _middles(field, vertices, ends[halved], sure[halved], mesh.edge)
        vertices, drawn = vertices.joined(new), np.concatenate([drawn, _drawn(state, new)])
        faces = split(faces, middle[sides], vertices.points)
    return CoarseMesh(mesh.edge, vertices, faces), drawn


def _far(field: Field, vertices: Vertices, ends, some, long, bound: float, edge: float, asked):
    """(e,) which of ``some`` edges the surface is too far from, and keys of the long ones about
    which the field was ``asked``, so that it is asked once."""
    moved = vertex_heights(vertices, ends, bound)[ends]
    most = _bounds(vertices, bound)[ends].min(axis=1)
    far = some & _is_off(vertices, ends, moved, most)
    keys = ends[:, 0] << 32 | ends[:, 1]
    ask = some & ~far & long & ~np.isin(keys, asked)
    ask[ask] = _is_off(vertices, ends[ask], moved[ask], _DOUBTED * most[ask])
    rise = _rise(field, vertices, ends[ask], edge) - moved[ask].mean(axis=1)
    far[ask] = np.abs(rise) > most[ask]
    return far, np.concatenate([asked, keys[ask]])


def edges_of(faces) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of triangles (f, 3), each once, the lower vertex first, and which edge (f, 3)
    follows each corner."""
    tails, heads = faces.astype(np.int64), np.roll(faces, -1, axis=1)
    keys, sides = np.unique(
        np.minimum(tails, heads) << 32 | np.maximum(tails, heads), return_inverse=True
    )
    return np.stack([keys >> 32, keys & (1 << 32) - 1], axis=1), sides.reshape(-1, 3)


def split(faces, middles, points) -> np.ndarray:
    """Triangles (g, 3) in the place of triangles (f, 3).

    Parameters
    ----------
    faces : (f, 3) int
    middles : (f, 3) int
        The vertex in the middle of the side that follows a corner; -1 where there is none.
    points : (v, 3) float, length
        Vertices. A quadrilateral is cut along its shorter diagonal.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0]])
    >>> split(np.array([[0, 1, 2]]), np.array([[3, -1, -1]]), points).tolist()
    [[0, 3, 2], [3, 1, 2]]
    """
    has = middles >= 0
    count = has.sum(axis=1)
    # Turned until the first side has a middle, and the second if two have.
    first = np.where(count == 1, has.argmax(axis=1), (has.argmin(axis=1) + 1) % 3)
    turned = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turned, axis=1).T
    m, n, p = np.take_along_axis(middles, turned, axis=1).T
    along, across = (((points[s] - points[t]) ** 2).sum(axis=1) for s, t in ((a, n), (m, c)))
    two, shorter = count == 2, along <= across
    parts = [
        (count == 0, (a, b, c)),
        *((count == 1, corners) for corners in ((a, m, c), (m, b, c))),
        (two, (m, b, n)),
        *((two & shorter, corners) for corners in ((a, m, n), (a, n, c))),
        *((two & ~shorter, corners) for corners in ((a, m, c), (m, n, c))),
        *((count == 3, corners) for corners in ((a, m, p), (m, b, n), (p, n, c), (m, n, p))),
    ]
    return np.concatenate([np.stack([x[some] for x in corners], axis=1) for some, corners in parts])


def _drawn(state: AtlasState, vertices: Vertices) -> np.ndarray:
    """(v,) whether the surface is known at vertices, supported by samples, and within its rims."""
    deviation, axes = np.sqrt(vertices.variance), state.table.axes[vertices.patch, 2]
    drawn = vertices.known & supported(state, vertices.patch, vertices.points, deviation)
    return drawn & ~state.rims.beyond(vertices.points, axes)


def _on_sheet(vertices: Vertices, ends) -> np.ndarray:
    """(e,) whether the ends (e, 2) of edges are on one sheet: with normals that agree."""
    normals = (vertices.normals[end] for end in ends.T)
    return np.asarray(np.einsum("ij,ij->i", *normals) > SHEET_COSINE)


def vertex_heights(vertices: Vertices, ends, bound: float) -> np.ndarray:
    """(v,) how far vertices are moved out, so that triangles lie above the surface as much as below
    it, length; ``bound`` at most.

    Over a triangle with its corners on the surface the mean height is the mean of the heights over
    the middles of its sides (second order).
    """
    count = len(vertices.points)
    a, b = _slopes(vertices, ends)
    heights = np.where(_on_sheet(vertices, ends), (a + b) / 8.0, 0.0)
    total, times = (
        np.bincount(ends.T.ravel(), np.tile(each, 2), count)
        for each in (heights, np.ones(len(ends)))
    )
    most = _bounds(vertices, bound)
    return np.clip(total / np.maximum(times, 1.0), -most, most)


def _bounds(vertices: Vertices, bound: float) -> np.ndarray:
    """(v,) the bound, or a tenth of the predicted deviation if that is more, length."""
    return np.maximum(bound, _UNSURE * np.sqrt(vertices.variance))


def _slopes(vertices: Vertices, ends):
    """Rise (e,) of the surface at the first of the ends (e, 2) of edges, and fall at the second,
    times the length of the edge."""
    first, second = ends.T
    chord = vertices.points[second] - vertices.points[first]
    rise = -np.einsum("ij,ij->i", chord, vertices.normals[first])
    return rise, np.einsum("ij,ij->i", chord, vertices.normals[second])


def _is_off(vertices: Vertices, ends, moved, bound) -> np.ndarray:
    """(e,) whether the surface is farther than bounds (e,) from edges whose ends are moved out by
    heights (e, 2), at the middle or at a quarter.

    The Hermite cubic of slopes a and -b at its ends is t (1 - t) ((1 - t) a + t b) high.
    """
    a, b = _slopes(vertices, ends)
    out = np.zeros(len(ends), bool)
    for t in (0.25, 0.5, 0.75):
        height = t * (1.0 - t) * ((1.0 - t) * a + t * b)
        out |= np.abs(height) > _MOVED * bound
        out |= np.abs(height - (1.0 - t) * moved[:, 0] - t * moved[:, 1]) > bound
    return out


def _rise(field: Field, vertices: Vertices, ends, edge: float) -> np.ndarray:
    """(e,) height of the surface over the middles of edges, length; 0 where it is unknown."""
    seen = field.at(vertices.points[ends].mean(axis=1), REACH * edge)
    return np.where(seen.known, -seen.distance, 0.0)


def _middles(field: Field, vertices: Vertices, ends, sure, edge: float) -> Vertices:
    """Vertices over the middles of edges, on their cubic curves; where these are not ``sure``,
    moved onto the surface from there."""
    a, b = _slopes(vertices, ends)
    normals = vertices.normals[ends].sum(axis=1)
    normals /= np.maximum(np.sqrt((normals**2).sum(axis=1)), np.finfo(float).tiny)[:, None]
    cosine = np.einsum("ij,ij->i", normals, vertices.normals[ends[:, 0]])
    height = (a + b) / (8.0 * np.maximum(cosine, _LEVEL))
    points = vertices.points[ends].mean(axis=1) + height[:, None] * normals
    patch = _nearer(field.table, vertices.patch[ends], points)
    means = vertices.variance[ends].mean(axis=1), vertices.curvature[ends].mean(axis=1)
    out = Vertices(points, normals, *means, patch, vertices.known[ends].all(axis=1))
    found = project(field, points[~sure], patch[~sure], edge)
    for column, new in zip(vars(out).values(), vars(found).values(), strict=True):
        column[~sure] = new
    return out


def _nearer(table: PatchTable, patch, points) -> np.ndarray:
    """(e,) the one of two patches (e, 2) that has the lesser power at points (e, 3)."""
    offset = points[:, None] - table.site[patch]
    power = np.einsum("ijk,ijk->ij", offset, offset) - table.weight[patch]
    return np.where(power[:, 1] < power[:, 0], patch[:, 1], patch[:, 0])
