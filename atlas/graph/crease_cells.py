"""The tiling with creases: cells end at them, and meet across them.

What the power diagram of each sheet says is kept where it lies on this side of all creases. A
crease is a boundary of two patches of different sheets; three boundaries meet where the
boundary of two kin runs into a crease, and where the creases of three sheets do.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from touchatlas.atlas.graph.cells import Pair, Places, Triple
from touchatlas.atlas.graph.crease_curves import CreaseCurves
from touchatlas.atlas.graph.creases import Crease, Creases
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, MEETS, Boundary, power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours, radical_parameter
from touchatlas.atlas.graph.visibility import Visibility
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# A corner is taken for an end of a crease within this many patch radii of it: curves are sampled.
# Doubled, the two ends of a crease as short as a tenth of a radius would be one.
_END = 0.05


def visible_places(visibility: Visibility, places: Places) -> Places:
    """Those of corners or gaps of three kin that lie on this side of all creases."""
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
    """Where two kin and a patch across a crease of both meet, and three creased patches.

    Returns
    -------
    corners, gaps : dict
        Triples of rows to the point (3,). At a gap one of the three does not cover the point:
        the last of the triple.
    """
    two, three = _triples(neighbours, creases)
    found = {
        **_on_radicals(table, creases, curves, two),
        **_of_three(table, curves, three),
    }
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
    """Triples of two kin and one that both are creased with (m, 3), in this order, and triples
    of three that are creased (n, 3), ascending."""
    two, three = set[Triple](), set[Triple]()
    for i, j in creases.pairs:
        for k in creases.of(i) & creases.of(j):
            three.add((min(i, j, k), i + j + k - min(i, j, k) - max(i, j, k), max(i, j, k)))
        two.update((min(i, k), max(i, k), j) for k in creases.of(j) & neighbours[i])
        two.update((min(j, k), max(j, k), i) for k in creases.of(i) & neighbours[j])
    return (np.array(sorted(some), int).reshape(-1, 3) for some in (two, three))


def _on_radicals(table: PatchTable, creases: Creases, curves: CreaseCurves, triples) -> Places:
    """Where the boundaries of two kin run into their crease with a third."""
    if not len(triples):
        return {}
    first, second, other = triples.T
    offset, square, parameter = radical_parameter(table, first, second)
    length = np.sqrt(square)[:, None]
    middle = table.site[first] + parameter[:, None] * offset
    planes = (offset / length)[:, None], (middle * offset / length).sum(axis=1)[:, None]
    start = np.array([creases.pairs[min(i, j), max(i, j)].anchor for i, _, j in triples.tolist()])
    found = _met(table, triples, triples[:, [0, 2]], start, planes)
    return {t: p for t, p in found.items() if _on_lines(table, creases, curves, t, p)}


def _on_lines(
    table: PatchTable, creases: Creases, curves: CreaseCurves, triple: Triple, point
) -> bool:
    """Whether a point is on the crease of two of three patches, between its ends."""
    for pair in combinations(triple, 2):
        line = curves.curve(*pair) if creases.sign(*pair) else np.zeros((0, 3))
        if len(line):
            along = line[-1] - line[0]
            parameter = (point - line[0]) @ along / (along @ along)
            slack = _END * table.radius[list(pair)].min() / np.sqrt(along @ along)
            if -slack <= parameter <= 1.0 + slack:
                return True
    return False


def _of_three(table: PatchTable, curves: CreaseCurves, triples) -> Places:
    """Where three patches meet, if that is an end of the crease of two of them."""
    ends = [line[[0, -1]] if len(line := curves.curve(i, j)) else None for i, j, _ in triples]
    keep = [e is not None for e in ends]
    found: Places = {}
    for side in (0, 1):
        start = np.array([e[side] for e in ends if e is not None]).reshape(-1, 3)
        some = triples[keep]
        near = _END * table.radius[some].min(axis=1)
        found |= _met(table, some, some, start, within=near)
    return found


def _met(table: PatchTable, triples, rows, start, planes=None, within=None) -> Places:
    """Points where patches ``rows`` (m, k) meet, of the triples where they do."""
    if not len(triples):
        return {}
    seen = intersect(table, rows, start, planes)
    good = (np.abs(seen.distance) <= MEETS * table.radius[rows]).all(axis=1)
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


def boundaries_with_creases(
    table: PatchTable,
    neighbours: SheetNeighbours,
    curves: CreaseCurves,
    visibility: Visibility,
    boundaries: Mapping[Pair, Boundary],
    ended: set[Pair],
) -> dict[Pair, Boundary]:
    """Boundaries of cells on this side of all creases, and the creases themselves.

    Those of the pairs ``ended`` by a corner may have no points.
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
    return out


def _owned_points(table: PatchTable, neighbours: SheetNeighbours, pair, points) -> np.ndarray:
    """Those of points (n, 3) of a crease at which both patches have the least power of their
    sheets."""
    keep = np.ones(len(points), bool)
    for i in pair:
        own = power_at(table, [i], points)[:, 0]
        rivals = power_at(table, sorted(neighbours[i]), points).min(axis=1, initial=np.inf)
        keep &= (own <= rivals) & (own <= CELL_MARGIN * table.weight[i])
    return points[keep]


def _crease_boundary(table: PatchTable, pair: Pair, points, crease: Crease) -> Boundary:
    where = points if len(points) else crease.anchor[None]
    normals = patches_at(table, np.tile(pair, (len(where), 1)), where).normals
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    return Boundary(pair, points, 0.0, angle, True)
