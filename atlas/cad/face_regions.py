"""Regions of a triangle mesh: connected triangles of one label, and the chains of edges between.

All is combinatorial. Loops of a closed mesh close, each chain lies between two regions, and chains
meet at nodes.
"""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

# What lies beyond the rim of an open mesh.
BEYOND = -1
# Triangles of the largest piece of one label that counts as a speck: two cubes of a lattice have
# about as many. Doubled, true faces of four cubes are lost.
_SPECK = 8
# Most rounds of labels taken from neighbours; a box takes one. Doubled, nothing changes.
_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Chain:
    """A line of mesh edges between two regions.

    Parameters
    ----------
    left, right : int
        Regions on either side, seen from outside; ``right`` is ``BEYOND`` at a rim.
    vertices : (k,) int
        Vertices of the mesh in order; the last is the first where the chain is closed.
    """

    left: int
    right: int
    vertices: np.ndarray


# A chain's number, and whether it is followed forward.
Use = tuple[int, bool]


@dataclass(frozen=True, eq=False)
class Regions:
    """The regions of a mesh.

    Parameters
    ----------
    of : (f,) int
        Region of each triangle.
    labels : (r,) int
        Label of each region.
    chains : tuple of Chain
    loops : tuple of tuple of tuple of Use
        For each region its loops, each a tuple of chains in order, the region on the left.
    """

    of: np.ndarray
    labels: np.ndarray
    chains: tuple[Chain, ...]
    loops: tuple[tuple[tuple[Use, ...], ...], ...]


def regions_of(faces, labels) -> Regions:
    """Regions of triangles (f, 3) with labels (f,), without specks.

    The triangles are a manifold, counter-clockwise seen from outside.
    """
    beside, _ = igl.triangle_triangle_adjacency(faces)
    labels = without_specks(beside, labels)
    of = _connected(beside, labels)
    successor = _successors(faces, beside, of)
    chains, loops = _chains(faces, beside, of, successor)
    first = np.unique(of, return_index=True)[1]
    return Regions(of, labels[first], chains, loops)


def without_specks(beside, labels) -> np.ndarray:
    """(f,) labels where small pieces of one label, and triangles of which two sides lie beside
    another label, take that of their neighbours; ``beside`` (f, 3) are the neighbours, or -1."""
    labels = np.array(labels)
    for _ in range(_ROUNDS):
        of = _connected(beside, labels)
        small = np.bincount(of)[of] <= _SPECK
        around = np.where(beside == BEYOND, BEYOND, labels[beside])
        other = (around != labels[:, None]) & (around != BEYOND)
        left = np.roll(around, 1, axis=1)
        tooth = other & np.roll(other, 1, axis=1) & (around == left)
        moved = tooth.any(axis=1) | (small & other.any(axis=1))
        if not moved.any():
            break
        best = np.where(tooth.any(axis=1), tooth.argmax(axis=1), other.argmax(axis=1))
        # Not two neighbours at once, or they would change places for ever.
        first = np.where(beside == BEYOND, len(labels), beside)
        alone = np.append(moved, False)[first] & (first < np.arange(len(labels))[:, None])
        moved &= ~alone.any(axis=1)
        rows = np.flatnonzero(moved)
        labels[rows] = around[rows, best[rows]]
    return labels


def _connected(beside, labels) -> np.ndarray:
    """(f,) number of the connected piece of one label of each triangle."""
    rows, sides = np.nonzero(beside != BEYOND)
    columns = beside[rows, sides]
    same = labels[rows] == labels[columns]
    shape = (len(labels), len(labels))
    graph = coo_matrix((np.ones(same.sum()), (rows[same], columns[same])), shape=shape)
    return np.asarray(connected_components(graph, directed=False)[1])


def _successors(faces, beside, of) -> dict[tuple[int, int], tuple[int, int]]:
    """For each side (triangle, place) on the border of its region the next one of that border:
    it is found by turning about the vertex between them within the region."""
    border = (beside == BEYOND) | (of[beside] != of[:, None])
    out = {}
    for t, k in zip(*(x.tolist() for x in np.nonzero(border)), strict=True):
        vertex, triangle, side = faces[t, (k + 1) % 3], t, (k + 1) % 3
        while not border[triangle, side]:
            triangle = int(beside[triangle, side])
            side = int(np.flatnonzero(faces[triangle] == vertex)[0])
        out[t, k] = (triangle, side)
    return out


def _chains(
    faces, beside, of, successor
) -> tuple[tuple[Chain, ...], tuple[tuple[tuple[Use, ...], ...], ...]]:
    """Chains and loops: the cycles of the successors, cut where the region beyond changes and
    where more than two chains meet."""
    nodes = _nodes(faces, beside, of, successor)
    chains: list[Chain] = []
    number: dict[tuple[int, int], Use] = {}
    loops: list[list[tuple[Use, ...]]] = [[] for _ in range(of.max(initial=-1) + 1)]
    left = dict.fromkeys(successor)
    while left:
        cycle = _cycle(successor, next(iter(left)))
        for side in cycle:
            del left[side]
        loop = []
        for run in _cut(cycle, [faces[side] in nodes for side in cycle]):
            if run[0] not in number:
                _enter(run, faces, beside, of, chains, number)
            loop.append(number[run[0]])
        loops[of[cycle[0][0]]].append(tuple(loop))
    return tuple(chains), tuple(map(tuple, loops))


def _cycle(successor, first) -> list[tuple[int, int]]:
    out = [first]
    while (side := successor[out[-1]]) != first:
        out.append(side)
    return out


def _nodes(faces, beside, of, successor) -> set[int]:
    """Vertices where a border is not between two regions, or where it is so more than once."""
    pairs: dict[int, list[tuple[int, ...]]] = {}
    for t, k in successor:
        other = int(of[beside[t, k]]) if beside[t, k] != BEYOND else BEYOND
        if other < of[t]:
            for vertex in (faces[t, k], faces[t, (k + 1) % 3]):
                pairs.setdefault(int(vertex), []).append((int(of[t]), other))
    return {v for v, around in pairs.items() if len(around) != 2 or around[0] != around[1]}


def _cut(cycle, starts) -> list[list[tuple[int, int]]]:
    """Runs of a cycle of sides that begin where ``starts`` says; the whole where it never does."""
    cuts = [i for i, at in enumerate(starts) if at]
    if not cuts:
        # The region beyond finds the same chain by any of its sides: see ``_enter``.
        return [cycle]
    turned = cycle[cuts[0] :] + cycle[: cuts[0]]
    ends = [c - cuts[0] for c in cuts[1:]] + [len(cycle)]
    return [turned[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def _enter(run, faces, beside, of, chains, number) -> None:
    """Enter the chain of a run of sides, under its sides of both regions."""
    vertices = [int(faces[side]) for side in run]
    t, k = run[-1]
    vertices.append(int(faces[t, (k + 1) % 3]))
    other = beside[run[0]]
    beyond = int(of[other]) if other != BEYOND else BEYOND
    use = len(chains)
    chains.append(Chain(int(of[run[0][0]]), beyond, np.array(vertices)))
    for side in run:
        number[side] = (use, True)
        other = int(beside[side])
        if other != BEYOND:
            back = int(np.flatnonzero(faces[other] == faces[side[0], (side[1] + 1) % 3])[0])
            number[other, back] = (use, False)
