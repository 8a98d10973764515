"""Cells at creases: which corners and boundaries remain, and which ones the creases add.

The power diagram of each sheet holds on the near side of all creases. A crease is a boundary of
two patches of different sheets. Corners are added where the boundary of two sheet neighbours ends
at a crease, and where the creases of three sheets meet.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from touchatlas.atlas.graph.cells import Places
from touchatlas.atlas.graph.crease_curves import CreaseCurves
from touchatlas.atlas.graph.creases import Crease, Creases
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, MEETS, Boundary, power_at
from touchatlas.atlas.graph.row_tuples import Pair, Triple, pair_of, triple_of
from touchatlas.atlas.graph.sheets import SheetNeighbours, radical_parameter
from touchatlas.atlas.graph.visibility import Visibility
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# Largest distance of a corner from the end of a crease curve, in patch radii: curves are sampled.
# Doubled, both ends of a crease as short as a fifth of a radius are taken for one.
_END = 0.05
# Rounding of a power at a corner, as a fraction of the weight: a corner is known less exactly than
# the points of a boundary. Doubled, nothing changes.
_TIE = 1e-9


def visible_places(visibility: Visibility, places: Places) -> Places:
    """The corners or gaps of three sheet neighbours that no crease cuts off from their patches."""
    if not places:
        return places
    triples, points = np.array(list(places)), np.array(list(places.values()))
    rows = triples.ravel()
    seen = visibility.sees(rows, np.repeat(points, 3, axis=0), np.ones(len(rows), bool))
    kept = np.asarray(seen.reshape(-1, 3).all(axis=1))
    return {t: p for (t, p), keep in zip(places.items(), kept, strict=True) if keep}


def crease_corners(
    table: PatchTable, neighbours: SheetNeighbours, creases: Creases, curves: CreaseCurves
) -> tuple[Places, Places]:
    """Corners of two sheet neighbours and a patch across a crease, and of three creased patches.

    Returns
    -------
    corners, gaps : dict
        Triples of rows, mapped to a point (3,). At a gap the last row does not cover the point.
    """
    two, three = _triples(neighbours, creases)
    found = _on_radicals(table, creases, curves, two) | _of_three(table, curves, three)
    corners: Places = {}
    gaps: Places = {}
    for triple, point in found.items():
        over = _excess(table, neighbours, triple, point)
        if over is not None and over[1] <= CELL_MARGIN:
            corners[triple] = point
        elif over is not None:
            one, other = (i for i in triple if i != over[0])
            gaps[one, other, over[0]] = point
    return corners, gaps


def _triples(neighbours: SheetNeighbours, creases: Creases):
    """Triples (m, 3) of two sheet neighbours and a row that is creased with both, in this order,
    and ascending triples (n, 3) of rows that are all creased with each other."""
    two, three = set[Triple](), set[Triple]()
    for i, j in creases.pairs:
        for k in creases.of(i) & creases.of(j):
            three.add(triple_of((i, j, k)))
        two.update((*pair_of(i, k), j) for k in creases.of(j) & neighbours[i])
        two.update((*pair_of(j, k), i) for k in creases.of(i) & neighbours[j])
    return (np.array(sorted(some), int).reshape(-1, 3) for some in (two, three))


def _on_radicals(table: PatchTable, creases: Creases, curves: CreaseCurves, triples) -> Places:
    """Where the boundary of the first two of three rows (m, 3) ends at a crease with the third."""
    if not len(triples):
        return {}
    first, second, other = triples.T
    offset, square, parameter = radical_parameter(table, first, second)
    length = np.sqrt(square)[:, None]
    middle = table.site[first] + parameter[:, None] * offset
    planes = (offset / length)[:, None], (middle * offset / length).sum(axis=1)[:, None]
    start = np.array([creases.pairs[pair_of(i, j)].anchor for i, _, j in triples.tolist()])
    found = _intersections(table, triples, triples[:, [0, 2]], start, planes)
    return {t: p for t, p in found.items() if _on_curves(table, creases, curves, t, p)}


def _on_curves(
    table: PatchTable, creases: Creases, curves: CreaseCurves, triple: Triple, point
) -> bool:
    """Whether a point is between the ends of the crease of two of three patches, with a margin."""
    for pair in combinations(triple, 2):
        line = curves.curve(*pair) if creases.sign(*pair) else np.zeros((0, 3))
        if len(line):
            along = line[-1] - line[0]
            parameter = (point - line[0]) @ along / (along @ along)
            margin = _END * table.radius[list(pair)].min() / np.sqrt(along @ along)
            if -margin <= parameter <= 1.0 + margin:
                return True
    return False


def _of_three(table: PatchTable, curves: CreaseCurves, triples) -> Places:
    """Where three patches meet, if an end of the crease of the first two is there."""
    ends = [line[[0, -1]] if len(line := curves.curve(i, j)) else None for i, j, _ in triples]
    keep = [e is not None for e in ends]
    found: Places = {}
    for side in (0, 1):
        start = np.array([e[side] for e in ends if e is not None]).reshape(-1, 3)
        kept = triples[keep]
        near = _END * table.radius[kept].min(axis=1)
        found |= _intersections(table, kept, kept, start, within=near)
    return found


def _intersections(table: PatchTable, triples, rows, start, planes=None, within=None) -> Places:
    """Ascending triples (of m) to the point where patches ``rows`` (m, k) and planes intersect:
    those where they do, at most ``within`` (m,) from the start (m, 3)."""
    if not len(triples):
        return {}
    seen = intersect(table, rows, start, planes)
    good = (np.abs(seen.distance) <= MEETS * table.radius[rows]).all(axis=1)
    good &= (seen.across <= 1.0).all(axis=1)
    if within is not None:
        offset = seen.points - start
        good &= (offset * offset).sum(axis=1) <= within**2
    found = map(triple_of, triples[good].tolist())
    return dict(zip(found, seen.points[good], strict=True))


def _excess(
    table: PatchTable, neighbours: SheetNeighbours, triple: Triple, point
) -> tuple[int, float] | None:
    """Which of three patches has the largest power over weight at a point, and that ratio; None
    where a neighbour of one of the three has less power than it."""
    worst = triple[0], -np.inf
    for i in triple:
        own = float(power_at(table, [i], point)[0])
        rivals = [j for j in neighbours[i] if j not in triple]
        if rivals and power_at(table, rivals, point).min() < own - _TIE * table.weight[i]:
            return None
        worst = max(worst, (i, own / float(table.weight[i])), key=lambda pair: pair[1])
    return worst


def boundaries_with_creases(
    table: PatchTable,
    neighbours: SheetNeighbours,
    curves: CreaseCurves,
    visibility: Visibility,
    boundaries: Mapping[Pair, Boundary],
    ended: set[Pair],
) -> dict[Pair, Boundary]:
    """Boundaries of cells, without the points beyond a crease, and the creases as boundaries.

    A boundary without points is there only if a corner ends it: its pair is in ``ended``.
    """
    out = {}
    for pair, boundary in boundaries.items():
        points = boundary.points
        for row in pair:
            whole = np.ones(len(points), bool)
            points = points[visibility.sees(np.full(len(points), row), points, whole)]
        if len(points) or pair in ended:
            out[pair] = replace(boundary, points=points)
    for pair, crease in curves.creases.pairs.items():
        points = _owned_points(table, neighbours, pair, curves.curve(*pair))
        if len(points) or pair in ended:
            out[pair] = _crease_boundary(table, pair, points, crease)
    # Two cells that meet in a corner alone, beside an edge.
    for pair in sorted(ended - out.keys()):
        out[pair] = Boundary(pair, np.zeros((0, 3)), 0.0, 0.0, False)
    return out


def _owned_points(table: PatchTable, neighbours: SheetNeighbours, pair, points) -> np.ndarray:
    """The points (of n) of a crease at which each patch of the pair has the least power of its
    sheet and covers the point."""
    keep = np.ones(len(points), bool)
    for i in pair:
        own = power_at(table, [i], points)[:, 0]
        rivals = power_at(table, sorted(neighbours[i]), points).min(axis=1, initial=np.inf)
        keep &= (own <= rivals) & (own <= CELL_MARGIN * table.weight[i])
    return points[keep]


def _crease_boundary(table: PatchTable, pair: Pair, points, crease: Crease) -> Boundary:
    """The points (b, 3) of a crease as a boundary; the angle is measured at its anchor if none."""
    where = points if len(points) else crease.anchor[None]
    normals = patches_at(table, np.tile(pair, (len(where), 1)), where).normals
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    return Boundary(pair, points, 0.0, angle, True)
