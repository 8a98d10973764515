"""Cube flood: the cubes of a lattice that the surface passes, found from seeds on it."""

import numpy as np

from touchatlas.atlas.contouring.cube_lattice import (
    CORNERS,
    EDGES,
    corners_of,
    crossed_neighbours,
    key,
    unkey,
)
from touchatlas.atlas.contouring.cube_sheets import edge_ends

# Offset of the lattice from the first seed, in edges, so that no lattice plane lies in a flat face.
# Any numbers without a small common multiple do; doubled, they do as well.
_OFFSET = np.array([0.31, 0.43, 0.37])


class Nodes:
    """Corners of the lattice with the signed distance there.

    Parameters
    ----------
    at : function
        Distance, normal and known at points.
    start : (3,) float, length
        The corner of index 0.
    edge : float, length
    """

    def __init__(self, at, start, edge: float):
        self.at, self.start, self.edge = at, start, edge
        self.keys = np.zeros(0, np.int64)
        self.distance = np.zeros(0)
        self.normal = np.zeros((0, 3))

    def points(self, keys) -> np.ndarray:
        """(..., 3) places of nodes (...)."""
        return unkey(keys) * self.edge + self.start

    def rows(self, keys) -> np.ndarray:
        """(...) rows of nodes (...), all of which must be there."""
        return np.searchsorted(self.keys, keys)

    def add(self, keys) -> None:
        """Evaluate those of the nodes (n,) that are not there. NaN stands for unknown."""
        new = new_keys(keys, self.keys)
        if not len(new):
            return
        distance, normal, known = self.at(self.points(new))
        place = self.rows(new)
        self.keys = np.insert(self.keys, place, new)
        self.distance = np.insert(self.distance, place, np.where(known, distance, np.nan))
        self.normal = np.insert(self.normal, place, normal, axis=0)


def flood(at, seeds, edge: float) -> tuple[Nodes, np.ndarray, np.ndarray]:
    """The cubes that the surface passes. The fill starts from the eight cubes nearest to each seed.

    Parameters
    ----------
    at : function
        From points (n, 3) to signed distance, normal and known, as of ``dual_contour``.
    seeds : (k, 3) float, length
        Points on the surface, at least one on each connected piece.
    edge : float, length
        Edge of the cubes.

    Returns
    -------
    nodes : Nodes
        The corners of all cubes that were asked.
    cubes : (c,) int
        Ascending keys of the cubes that the surface passes.
    inside : (c, 8) bool
        Whether each of their corners is inside.

    Raises
    ------
    ValueError
        The edge is not positive, or there is no seed.
    """
    seeds = np.asarray(seeds, float).reshape(-1, 3)
    if not edge > 0.0:
        raise ValueError(f"the edge of the cubes must be positive, not {edge}")
    if not len(seeds):
        raise ValueError("a surface needs at least one seed: give a point on it")
    nodes = Nodes(at, seeds[0] + _OFFSET * edge, edge)
    near = np.floor((seeds - nodes.start) / nodes.edge - 0.5).astype(np.int64)
    fresh = np.unique(key(near[:, None] + CORNERS))
    tried, found = fresh[:0], [fresh[:0]]
    while len(fresh):
        tried = np.insert(tried, np.searchsorted(tried, fresh), fresh)
        nodes.add(corners_of(fresh))
        distance = nodes.distance[nodes.rows(corners_of(fresh))]
        inside = distance < 0.0
        passed = inside.any(axis=1) & ~inside.all(axis=1) & ~np.isnan(distance).any(axis=1)
        found.append(fresh[passed])
        fresh = new_keys(crossed_neighbours(fresh[passed], inside[passed]), tried)
    cubes = np.sort(np.concatenate(found))
    return nodes, cubes, nodes.distance[nodes.rows(corners_of(cubes))] < 0.0


def new_keys(keys, old) -> np.ndarray:
    """Ascending keys, once each, of those that are not among ascending old ones (n,)."""
    keys = np.unique(keys)
    place = np.minimum(np.searchsorted(old, keys), len(old) - 1)
    return keys[old[place] != keys] if len(old) else keys


def edge_keys(cubes) -> np.ndarray:
    """(c, 12) keys of the edges of cubes (c,)."""
    return (corners_of(cubes)[:, edge_ends()[:, 0]] << 2) + EDGES[:, 3]
