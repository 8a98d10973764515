"""Refine: edges of triangles are halved until the triangles are near enough to the surface.

The field is asked for its distance from the middles of edges; along sharp edges of the body both
faces are asked. Two triangles share what becomes of their edge, so that no gap opens.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.field.face_field import FaceValues
from touchatlas.atlas.field.face_trees import FaceTrees
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.records.surface import Surface

# Least angle between the triangles on both sides of an edge that is sharp, rad. Of blunter ones
# the triangles are chords.
_TURN = np.deg2rad(10.0)


def refined(body: Body, surface: Surface, bound: float) -> Surface:
    """A surface whose triangles are within a bound of a body, without curvatures. Its deviation
    takes in how far they are.

    Parameters
    ----------
    body : Body
    surface : Surface
        With vertices on the body.
    bound : float, length
        Largest distance of the body from the middles of edges; a tenth of the predicted deviation
        where that is more. Edges shorter than a thousandth of the extent stay, and those where the
        field jumps.
    """
    keys, heights, smooth = np.zeros(0, np.int64), np.zeros(0), body.is_one_face
    most = 4 if smooth else 7
    for done in range(most + 1):
        ends, sides = edges_of(surface.faces)
        named = ends[:, 0] << 32 | ends[:, 1]
        fresh = np.flatnonzero(~np.isin(named, keys))
        height, foot = _heights(body, surface, ends[fresh], bound if done else 0.0)
        if not smooth:
            beside = triangles_beside(sides, len(ends))[fresh]
            along, feet = feet_on_sharp_edges(body, surface, ends[fresh], beside, bound)
            middles = surface.vertices[ends[fresh[along]]].mean(axis=1)
            height[along], foot[along] = np.linalg.norm(feet - middles, axis=1), feet
        keys, heights = np.append(keys, named[fresh]), np.append(heights, height)
        if done == most:
            break
        far = np.flatnonzero(_are_far(body, surface, ends[fresh], height, bound))
        at = body.field.at(foot[far])
        # Where the field jumps no foot is nearer, and triangles would fold.
        nearer = np.abs(at.distance) < 0.5 * np.abs(height[far])
        far, at = far[nearer], at.some(nearer)
        if not len(far):
            break
        middle = np.full(len(ends), -1)
        middle[fresh[far]] = len(surface.vertices) + np.arange(len(far))
        new = _on_body(surface, foot[far], at)
        faces = split(
            surface.faces, middle[sides], np.concatenate([surface.vertices, new.vertices])
        )
        surface = surface.extended([new], faces, np.zeros((0, 3)))
    order = np.argsort(keys)
    heights = heights[order][np.searchsorted(keys[order], named)]
    highest = np.zeros(len(surface.vertices))
    np.maximum.at(highest, ends.T.ravel(), np.tile(np.abs(heights), 2))
    chord = 2.0 / 3.0 * np.minimum(highest, bound)
    if not smooth:
        return replace(surface, deviation=np.hypot(surface.deviation, chord))
    out = _outward(surface, ends, heights, bound)
    return replace(
        surface,
        vertices=surface.vertices + out[:, None] * surface.normals,
        deviation=np.hypot(surface.deviation, np.maximum(np.abs(out), 0.5 * chord)),
    )


def _are_far(body: Body, surface: Surface, ends, height, bound: float) -> np.ndarray:
    """(e,) whether the body is too far from the middles of edges (e, 2), by its heights (e,)."""
    unsure = 0.1 * surface.deviation[ends].mean(axis=1)
    limit = (1.1 if body.is_one_face else 0.8) * np.maximum(bound, unsure)
    length = np.linalg.norm(np.diff(surface.vertices[ends], axis=1)[:, 0], axis=1)
    return np.asarray((np.abs(height) > limit) & (length > 1e-3 * body.extent))


def _heights(body: Body, surface: Surface, ends, bound: float):
    """Heights (e,) of the body over the middles of edges (e, 2), length, and its points (e, 3)
    there. The field is not asked where the normals at both ends tell that they are far below the
    bound."""
    first, second = surface.vertices[ends.T]
    along, turn = second - first, surface.normals[ends[:, 1]] - surface.normals[ends[:, 0]]
    height, foot = (along * turn).sum(axis=1) / 8.0, 0.5 * (first + second)
    ask = np.abs(height) >= 0.3 * bound
    found = body.field.at(foot[ask])
    most = 0.5 * np.linalg.norm(along[ask], axis=1)
    height[ask] = np.clip(-found.distance, -most, most)
    foot[ask] += height[ask, None] * found.normal
    return height, foot


def _on_body(surface: Surface, points, found: FaceValues) -> Surface:
    """Vertices at points (n, 3) that are nearly on the body, by what the field says there, without
    triangles."""
    return Surface(
        points - found.distance[:, None] * found.normal,
        np.zeros((0, 3), int),
        found.normal,
        np.minimum(found.deviation, surface.deviation.max()),
        found.face,
        np.zeros(len(points)),
    )


def _outward(surface: Surface, ends, heights, bound: float) -> np.ndarray:
    """(v,) how far vertices are moved out, length, so that triangles are above the body as much as
    below it; ``heights`` (e,), length, are those of the body over edges ``ends`` (e, 2)."""
    count = len(surface.vertices)
    total, times = (
        np.bincount(ends.T.ravel(), np.tile(each, 2), count)
        for each in (heights, np.ones(len(ends)))
    )
    return np.clip(2.0 / 3.0 * total / np.maximum(times, 1.0), -bound, bound)


def feet_on_sharp_edges(
    body: Body, surface: Surface, ends, triangles, bound: float
) -> tuple[np.ndarray, np.ndarray]:
    """Which (k,) of edges (e, 2) of triangles run along a sharp edge that may bend, and the points
    (k, 3) of that edge over their middles, length, world.

    Both ends lie on the same two faces, and the triangles beside it turn there.

    Parameters
    ----------
    body : Body
        With sharp edges.
    surface : Surface
    ends : (e, 2) int
        Vertices.
    triangles : (e, 2) int
        The triangles on both sides; -1 where there is none.
    bound : float, length
        Largest distance of the body from triangles.
    """
    rows = np.flatnonzero(_turns(surface, triangles))
    trees, middles = body.field.trees, surface.vertices[ends[rows]].mean(axis=1)
    used, place = np.unique(ends[rows], return_inverse=True)
    on = np.abs(trees.all_distances(surface.vertices[used])) < 0.25 * bound
    both = on[place.reshape(-1, 2)].all(axis=1)
    half = 0.5 * np.linalg.norm(np.diff(surface.vertices[ends[rows]], axis=1)[:, 0], axis=1)
    found, feet = np.zeros(len(rows), bool), middles.copy()
    for pair in _bent_pairs(body, both):
        mine = np.flatnonzero(both[:, pair].all(axis=1) & ~found)
        at, good = _newton(trees, pair, middles[mine], 0.25 * bound)
        good &= ((at - middles[mine]) ** 2).sum(axis=1) < half[mine] ** 2
        feet[mine[good]], found[mine[good]] = at[good], True
    return rows[found], feet[found]


def _turns(surface: Surface, triangles) -> np.ndarray:
    """(e,) whether two triangles (e, 2) meet at an angle."""
    corners = surface.vertices[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    cosine = (normals[triangles[:, 0]] * normals[triangles[:, 1]]).sum(axis=1)
    return np.asarray((triangles >= 0).all(axis=1) & (cosine < np.cos(_TURN)))


def _bent_pairs(body: Body, both) -> list[list[int]]:
    """Pairs of faces, one of them no plane, on which both ends of an edge lie: (k, f) for each edge
    and face."""
    faces = body.faces.faces
    bent = {f.id for f in faces if f.law is None or f.pieces[0].kind is not Kind.PLANE}
    patterns = np.unique(both, axis=0)
    pairs = {p for row in patterns for p in combinations(np.flatnonzero(row).tolist(), 2)}
    return [list(pair) for pair in sorted(pairs) if bent & set(pair)]


def _newton(trees: FaceTrees, pair, points, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) moved onto both faces of a pair by steps of least length, and whether (n,) they
    lie within ``near`` (length) of both, which differ there by an angle."""
    at = points
    for step in range(5):
        one, other = (trees.of(k).values(at)[:, :4] for k in pair)
        cosine = (one[:, 1:] * other[:, 1:]).sum(axis=1)
        square = np.maximum(1.0 - cosine**2, np.sin(_TURN) ** 2)
        if step == 4:
            break
        along = (one[:, 0] - cosine * other[:, 0]) / square
        across = (other[:, 0] - cosine * one[:, 0]) / square
        at = at - along[:, None] * one[:, 1:] - across[:, None] * other[:, 1:]
    good = np.maximum(np.abs(one[:, 0]), np.abs(other[:, 0])) < near
    return at, good & (np.abs(cosine) < np.cos(_TURN))


def edges_of(faces) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of triangles (f, 3), each once, the lower vertex first, and which edge (f, 3)
    follows each corner."""
    tails, heads = faces.astype(np.int64), np.roll(faces, -1, axis=1)
    keys, sides = np.unique(
        np.minimum(tails, heads) << 32 | np.maximum(tails, heads), return_inverse=True
    )
    return np.stack([keys >> 32, keys & (1 << 32) - 1], axis=1), sides.reshape(-1, 3)


def triangles_beside(sides, count: int) -> np.ndarray:
    """(e, 2) the triangles on both sides of each of so many edges, from the edges (f, 3) of
    triangles; -1 where there is none."""
    out = np.full((count, 2), -1)
    order = np.argsort(sides.ravel(), kind="stable")
    edge = sides.ravel()[order]
    second = np.append(False, edge[1:] == edge[:-1])
    out[edge, second.astype(int)] = order // 3
    return out


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
