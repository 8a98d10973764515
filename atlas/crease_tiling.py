"""The tiling with creases: cells end at them, and meet across them.

What the power diagram of each sheet says is kept where it lies on this side of all creases. A
crease is a boundary of two patches of different sheets; three boundaries meet where the
boundary of two kin runs into a crease, and where the creases of three sheets do.
"""

from itertools import combinations

import networkx as nx
import numpy as np

from touchatlas.atlas.boundary import CELL_MARGIN, Boundary, power_at
from touchatlas.atlas.creases import Creases
from touchatlas.atlas.kin import Kin, radical_share
from touchatlas.atlas.meeting import look, meet
from touchatlas.atlas.table import Table
from touchatlas.atlas.tiling import Tiling, Triple

# Patches meet, and a corner is an end of a crease, as far as this share of their radii.
_MEETS, _END = 1e-6, 0.05


def visible(creases: Creases, places: dict[Triple, np.ndarray]) -> dict[Triple, np.ndarray]:
    """Those of corners or gaps of three kin that lie on this side of all creases."""
    if not creases or not places:
        return places
    triples, points = np.array(list(places)), np.array(list(places.values()))
    rows = triples.ravel()
    seen = creases.sees(rows, np.repeat(points, 3, axis=0), np.ones(len(rows), bool))
    kept = seen.reshape(-1, 3).all(axis=1)
    return {t: p for (t, p), keep in zip(places.items(), kept, strict=True) if keep}


def crease_corners(table: Table, kin: Kin, creases: Creases) -> dict[Triple, np.ndarray]:
    """Corners of two kin and a patch across a crease of both, and of three creased patches."""
    found: dict[Triple, np.ndarray] = {}
    for (i, j), crease in creases.pairs.items():
        line = creases.curve(i, j)
        if not len(line):
            continue
        both = creases.of(i) & creases.of(j)
        for k in sorted(both | (creases.of(j) & kin[i]) | (creases.of(i) & kin[j])):
            triple = tuple(sorted((i, j, k)))
            if k in kin[i] or k in kin[j]:
                pair, other = ((i, k), j) if k in kin[i] else ((j, k), i)
                point = _on_radical(table, *pair, other, crease.anchor)
            else:
                point = _of_three(table, triple, line)
            if point is not None and _owned(table, kin, triple, point):
                found[triple] = point
    return found


def _on_radical(table: Table, first: int, second: int, other: int, start):
    """Where the boundary of two kin runs into their crease with another: (3,), or None."""
    offset, _, share = radical_share(table, first, np.array([second]))
    level = (table.site[first] + share[0] * offset[0]) @ offset[0]
    length = np.sqrt(offset[0] @ offset[0])
    planes = (offset / length)[None], np.array([[level / length]])
    return _met(table, (first, other), start, planes)


def _of_three(table: Table, triple: Triple, line):
    """Where three patches meet, if that is an end of the crease of two of them."""
    for end in (line[0], line[-1]):
        point = _met(table, triple, end)
        if point is not None:
            offset = point - end
            if offset @ offset <= (_END * table.radius[list(triple)].min()) ** 2:
                return point
    return None


def _met(table: Table, rows, start, planes=None):
    seen = meet(table, np.array([rows]), start[None], planes)
    good = np.abs(seen.distance[0]) <= _MEETS * table.radius[list(rows)]
    return seen.points[0] if good.all() and (seen.across[0] <= 1.0).all() else None


def _owned(table: Table, kin: Kin, triple: Triple, point) -> bool:
    """Whether each of three patches has the least power of its sheet at a point."""
    for i in triple:
        own = power_at(table, [i], point)[0]
        slack = 1e-9 * table.power[i]
        rivals = [j for j in kin[i] if j not in triple]
        if own > CELL_MARGIN * table.power[i]:
            return False
        if rivals and power_at(table, rivals, point).min() < own - slack:
            return False
    return True


def folded_graph(
    table: Table, kin: Kin, creases: Creases, tiling: Tiling, corners: dict[Triple, np.ndarray]
) -> nx.Graph:
    """The dual graph: boundaries on this side of the creases, and the creases themselves."""
    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(tiling.graph)
    ended = {pair for triple in corners for pair in combinations(triple, 2)}
    for i, j, data in tiling.graph.edges(data=True):
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
        points = _owned_points(table, kin, pair, creases.curve(*pair))
        if len(points) or pair in ended:
            graph.add_edge(*pair, boundary=_crease_boundary(table, pair, points, creases))
    return graph


def _owned_points(table: Table, kin: Kin, pair, points) -> np.ndarray:
    """Those of points (n, 3) of a crease at which both patches have the least power of their
    sheets."""
    keep = np.ones(len(points), bool)
    for i in pair:
        own = power_at(table, [i], points)[:, 0]
        rivals = power_at(table, sorted(kin[i]), points).min(axis=1, initial=np.inf)
        keep &= (own <= rivals) & (own <= CELL_MARGIN * table.power[i])
    return points[keep]


def _crease_boundary(table: Table, pair, points, creases: Creases) -> Boundary:
    where = points if len(points) else creases.pairs[pair].anchor[None]
    normals = look(table, np.tile(pair, (len(where), 1)), where).normals
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    return Boundary(pair, points, 0.0, angle, True)
