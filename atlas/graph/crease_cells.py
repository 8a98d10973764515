"""The tiling with creases: cells end at them, and meet across them.

What the power diagram of each sheet says is kept where it lies on this side of all creases. A
crease is a boundary of two patches of different sheets; three boundaries meet where the
boundary of two kin runs into a crease, and where the creases of three sheets do.
"""

from itertools import combinations

import networkx as nx
import numpy as np

from touchatlas.atlas.graph.cells import Cells, Triple
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, Boundary, power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours, radical_share
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# Patches meet, and a corner is an end of a crease, as far as this share of their radii.
_MEETS, _END = 1e-6, 0.05


def visible(creases: Creases, places: dict[Triple, np.ndarray]) -> dict[Triple, np.ndarray]:
    """Those of corners or gaps of three kin that lie on this side of all creases."""
    if not creases or not places:
        return places
    triples, points = np.array(list(places)), np.array(list(places.values()))
    rows = triples.ravel()
    seen = creases.sees(rows, np.repeat(points, 3, axis=0), np.ones(len(rows), bool))
    kept = np.asarray(seen.reshape(-1, 3).all(axis=1))
    return {t: p for (t, p), keep in zip(places.items(), kept, strict=True) if keep}


def crease_corners(table: PatchTable, neighbours: SheetNeighbours, creases: Creases):
    """Where two kin and a patch across a crease of both meet, and three creased patches.

    Returns
    -------
    corners, gaps : dict
        Triples of rows to the point (3,). At a gap one of the three does not cover the point:
        the last of the triple.
    """
    two, three = _triples(neighbours, creases)
    found = {**_on_radicals(table, creases, two), **_of_three(table, creases, three)}
    corners: dict[Triple, np.ndarray] = {}
    gaps: dict[Triple, np.ndarray] = {}
    for triple, point in found.items():
        over = _excess(table, neighbours, triple, point)
        if over is not None and over[1] <= CELL_MARGIN:
            corners[triple] = point
        elif over is not None:
            one, other = (i for i in triple if i != over[0])
            gaps[one, other, over[0]] = point
    return corners, gaps


def _triples(neighbours: SheetNeighbours, creases: Creases):
    """Triples of two kin and one that both are creased with (m, 3), in this order, and triples
    of three that are creased (n, 3), ascending."""
    two, three = set[Triple](), set[Triple]()
    for i, j in creases.pairs:
        for k in creases.of(i) & creases.of(j):
            three.add((min(i, j, k), i + j + k - min(i, j, k) - max(i, j, k), max(i, j, k)))
        two.update((min(i, k), max(i, k), j) for k in creases.of(j) & neighbours[i])
        two.update((min(j, k), max(j, k), i) for k in creases.of(i) & neighbours[j])
    return (np.array(sorted(some), int).reshape(-1, 3) for some in (two, three))


def _on_radicals(table: PatchTable, creases: Creases, triples) -> dict[Triple, np.ndarray]:
    """Where the boundaries of two kin run into their crease with a third."""
    if not len(triples):
        return {}
    first, second, other = triples.T
    offset, square, share = radical_share(table, first, second)
    length = np.sqrt(square)[:, None]
    middle = table.site[first] + share[:, None] * offset
    planes = (offset / length)[:, None], (middle * offset / length).sum(axis=1)[:, None]
    start = np.array([creases.pairs[min(i, j), max(i, j)].anchor for i, _, j in triples.tolist()])
    found = _met(table, triples, triples[:, [0, 2]], start, planes)
    return {t: p for t, p in found.items() if _on_lines(table, creases, t, p)}


def _on_lines(table: PatchTable, creases: Creases, triple: Triple, point) -> bool:
    """Whether a point is on the crease of two of three patches, between its ends."""
    for pair in combinations(triple, 2):
        line = creases.curve(*pair) if creases.sign(*pair) else np.zeros((0, 3))
        if len(line):
            along = line[-1] - line[0]
            share = (point - line[0]) @ along / (along @ along)
            slack = _END * table.radius[list(pair)].min() / np.sqrt(along @ along)
            if -slack <= share <= 1.0 + slack:
                return True
    return False


def _of_three(table: PatchTable, creases: Creases, triples) -> dict[Triple, np.ndarray]:
    """Where three patches meet, if that is an end of the crease of two of them."""
    ends = [line[[0, -1]] if len(line := creases.curve(i, j)) else None for i, j, _ in triples]
    keep = [e is not None for e in ends]
    found: dict[Triple, np.ndarray] = {}
    for side in (0, 1):
        start = np.array([e[side] for e in ends if e is not None]).reshape(-1, 3)
        some = triples[keep]
        near = _END * table.radius[some].min(axis=1)
        found |= _met(table, some, some, start, within=near)
    return found


def _met(
    table: PatchTable, triples, rows, start, planes=None, within=None
) -> dict[Triple, np.ndarray]:
    """Points where patches ``rows`` (m, k) meet, of the triples where they do."""
    if not len(triples):
        return {}
    seen = intersect(table, rows, start, planes)
    good = (np.abs(seen.distance) <= _MEETS * table.radius[rows]).all(axis=1)
    good &= (seen.across <= 1.0).all(axis=1)
    if within is not None:
        offset = seen.points - start
        good &= (offset * offset).sum(axis=1) <= within**2
    triples = np.sort(triples[good], axis=1).tolist()
    return {(i, j, k): p for (i, j, k), p in zip(triples, seen.points[good], strict=True)}


def _excess(
    table: PatchTable, neighbours: SheetNeighbours, triple: Triple, point
) -> tuple[int, float] | None:
    """The patch of three that covers a point the least, and its power there over its squared
    core radius; None where another patch of a sheet has less power."""
    worst = triple[0], -np.inf
    for i in triple:
        own = float(power_at(table, [i], point)[0])
        rivals = [j for j in neighbours[i] if j not in triple]
        if rivals and power_at(table, rivals, point).min() < own - 1e-9 * table.weight[i]:
            return None
        worst = max(worst, (i, own / float(table.weight[i])), key=lambda pair: pair[1])
    return worst


def graph_with_creases(
    table: PatchTable,
    neighbours: SheetNeighbours,
    creases: Creases,
    cells: Cells,
    corners: dict[Triple, np.ndarray],
) -> nx.Graph:
    """The dual graph: boundaries on this side of the creases, and the creases themselves."""
    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(cells.graph)
    ended = {pair for triple in corners for pair in combinations(triple, 2)}
    for i, j, data in cells.graph.edges(data=True):
        boundary = data["boundary"]
        points = boundary.points
        for row in (i, j):
            whole = np.ones(len(points), bool)
            points = points[creases.sees(np.full(len(points), row), points, whole)]
        pair = boundary.patches
        if len(points) or pair in ended:
            kept = Boundary(pair, points, boundary.gap_rms, boundary.normal_gap, boundary.crease)
            graph.add_edge(*pair, boundary=kept)
    for pair in creases.pairs:
        points = _owned_points(table, neighbours, pair, creases.curve(*pair))
        if len(points) or pair in ended:
            graph.add_edge(*pair, boundary=_crease_boundary(table, pair, points, creases))
    return graph


def _owned_points(table: PatchTable, neighbours: SheetNeighbours, pair, points) -> np.ndarray:
    """Those of points (n, 3) of a crease at which both patches have the least power of their
    sheets."""
    keep = np.ones(len(points), bool)
    for i in pair:
        own = power_at(table, [i], points)[:, 0]
        rivals = power_at(table, sorted(neighbours[i]), points).min(axis=1, initial=np.inf)
        keep &= (own <= rivals) & (own <= CELL_MARGIN * table.weight[i])
    return points[keep]


def _crease_boundary(table: PatchTable, pair, points, creases: Creases) -> Boundary:
    where = points if len(points) else creases.pairs[pair].anchor[None]
    normals = patches_at(table, np.tile(pair, (len(where), 1)), where).normals
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    return Boundary(pair, points, 0.0, angle, True)
