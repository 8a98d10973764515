"""Points of a sharp edge over the middles of the triangles' edges that run along it."""

from itertools import combinations

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.field.face_trees import FaceTrees
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.records.surface import Surface

# Least angle between the triangles on both sides of an edge that is sharp, rad. Doubled, blunter
# sharp edges are chords.
_TURN = np.deg2rad(10.0)
# Distance from a face at which a vertex lies on it, in bounds. Doubled, vertices beside an edge are
# taken for those on it.
_ON = 0.25
# Newton steps to both faces; each about squares the error. Doubled, nothing changes.
_STEPS = 4


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
    on = np.abs(trees.all_distances(surface.vertices[used])) < _ON * bound
    both = on[place.reshape(-1, 2)].all(axis=1)
    half = 0.5 * np.linalg.norm(np.diff(surface.vertices[ends[rows]], axis=1)[:, 0], axis=1)
    found, feet = np.zeros(len(rows), bool), middles.copy()
    for pair in _bent_pairs(body, both):
        mine = np.flatnonzero(both[:, pair].all(axis=1) & ~found)
        at, good = _newton(trees, pair, middles[mine], _ON * bound)
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
    for step in range(_STEPS + 1):
        one, other = (trees.values(k, at)[:, :4] for k in pair)
        cosine = (one[:, 1:] * other[:, 1:]).sum(axis=1)
        square = np.maximum(1.0 - cosine**2, np.sin(_TURN) ** 2)
        if step == _STEPS:
            break
        along = (one[:, 0] - cosine * other[:, 0]) / square
        across = (other[:, 0] - cosine * one[:, 0]) / square
        at = at - along[:, None] * one[:, 1:] - across[:, None] * other[:, 1:]
    good = np.maximum(np.abs(one[:, 0]), np.abs(other[:, 0])) < near
    return at, good & (np.abs(cosine) < np.cos(_TURN))
