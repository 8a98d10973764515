"""Trimmed patches: every patch of an atlas trimmed to its own cell, so that together they tile.

Each corner ends one side of each of its three patches and begins the next side. So the sides are
chained to loops by their ends alone, without any search in space. A side that has no corner at one
end runs out to the rims of the two cores. From there the loop follows the rim of its own patch: the
frontier.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import count, pairwise

import numpy as np

from touchatlas.atlas.cad.bezier import bernstein, bernstein_slopes, curve_poles
from touchatlas.atlas.cad.trim_curves import ARC_DEGREE, SharedCurve, rim_arcs, shared_curve
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.patch import Patch

# Points of Gauss's rule per direction. It integrates polynomials of degree 23 exactly; doubled,
# nothing changes but the time.
_GAUSS = 12


@dataclass(frozen=True, eq=False)
class Side:
    """One side of a patch's cell.

    Parameters
    ----------
    number : int
        Number of the arc; the neighbour's side on the same arc has the same number.
    neighbour : int or None
        Patch beyond the arc; None on the frontier.
    points : (9, 3) float, length, world
        Points at the Chebyshev points of the arc's parameter, counter-clockwise seen from outside.
        The neighbour has the same points in the opposite order. Sides that follow each other share
        an end bit for bit.
    """

    number: int
    neighbour: int | None
    points: np.ndarray


@dataclass(frozen=True, eq=False)
class TrimmedPatch:
    """A patch trimmed to its own cell.

    Parameters
    ----------
    patch : Patch
    sides : tuple of Side
        In order, counter-clockwise seen from outside.
    """

    patch: Patch
    sides: tuple[Side, ...]

    @property
    def loop(self) -> np.ndarray:
        """(n, 3) points of all sides in order, world; the last is followed by the first."""
        return np.concatenate([side.points[:-1] for side in self.sides])

    @cached_property
    def traces(self) -> tuple[np.ndarray, ...]:
        """(9, 2) local x, y of each side's feet on the patch, length. They trim its domain.

        The side itself is off the patch by half the gap to the neighbour. The error of one step
        along the normal is no more than the square of that times the curvature.
        """
        points = np.concatenate([side.points for side in self.sides])
        offset = self.patch.signed_distance(points)[:, None] * self.patch.normal(points)
        feet = self.patch.frame.to_local(points - offset)[:, :2]
        return tuple(np.split(feet, len(self.sides)))

    @property
    def neighbours(self) -> tuple[int | None, ...]:
        """The patch beyond each side; None on the frontier."""
        return tuple(side.neighbour for side in self.sides)

    @property
    def closed(self) -> bool:
        """Whether no side is on the frontier."""
        return None not in self.neighbours

    def quadrature(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (q, 2), local, and weights (q,), length^2, that integrate over the cell.

        Gauss's rule on the triangles from the origin to the sides, with signed areas. It holds for
        a loop of any shape and a function over the tangent plane that is smooth on the triangles.
        """
        node, weight = np.polynomial.legendre.leggauss(_GAUSS)
        node, weight = 0.5 * (node + 1.0), 0.5 * weight
        value, slope = bernstein(ARC_DEGREE, node), bernstein_slopes(ARC_DEGREE, node)
        poles = [curve_poles(trace) for trace in self.traces]
        rim = np.concatenate([value @ p for p in poles])
        run = np.concatenate([slope @ p for p in poles])
        swept = rim[:, 0] * run[:, 1] - rim[:, 1] * run[:, 0]
        swept = swept * np.tile(weight, len(poles))
        points = node[:, None, None] * rim
        return points.reshape(-1, 2), np.outer(node * weight, swept).ravel()

    @property
    def area(self) -> float:
        """Area of the trimmed patch, length^2: the integral of sqrt(1 + zx^2 + zy^2).

        NaN where the patch stands upright within its cell.
        """
        points, weights = self.quadrature()
        slope = self.patch.polynomial.gradient(points)
        return float(weights @ np.sqrt(1.0 + (slope * slope).sum(axis=1)))


@dataclass(frozen=True, eq=False)
class _Half:
    """A side that is to be chained, with the names of its two ends."""

    start: tuple
    end: tuple
    side: Side


def trimmed_patches(state: AtlasState) -> list[TrimmedPatch]:
    """Every patch of an atlas trimmed to its own cell, by ascending patch id.

    Parameters
    ----------
    state : AtlasState
        Best after ``finish``.

    Returns
    -------
    list of TrimmedPatch
        One for each patch with a cell; several where the cell is in pieces.

    Raises
    ------
    ValueError
        When the atlas has no patch.

    Notes
    -----
    The cells are those of the power diagram on the surface (see ``graph/power_diagram.py``).
    """
    if not len(state):
        raise ValueError("the atlas has no patch yet; add a touch with three contours first")
    numbers, faces = count(), []
    patches = {i: state.patch(i) for i in sorted(state.graph)}
    halves = _shared_sides(state, patches, numbers)
    for i, patch in patches.items():
        if halves[i] or _owns_its_site(state, i):
            loops = _loops(patch, float(state.table.weight[i]), halves[i], numbers)
            found = [TrimmedPatch(patch, sides) for sides in loops]
            # A clockwise loop encloses nothing.
            faces += [face for face in found if face.quadrature()[1].sum() > 0.0]
    return faces


def _shared_sides(state: AtlasState, patches, numbers) -> dict[int, list[_Half]]:
    """The sides of each patch that it shares with a neighbour."""
    table, graph = state.table, state.graph
    halves: dict[int, list[_Half]] = {i: [] for i in patches}
    begins, finishes = _corner_ends(state, patches)
    for i, j in sorted(tuple(sorted(edge)) for edge in graph.edges):
        curve = shared_curve(patches[i], patches[j], table.site[[i, j]], table.weight[[i, j]])
        has_points = bool(len(graph.edges[i, j]["boundary"].points))
        ends = begins.get((i, j), []), finishes.get((i, j), [])
        for start, end in _spans(curve, *ends, has_points):
            points, number = curve.arc(start[1], end[1]), next(numbers)
            halves[i].append(_Half(start[0], end[0], Side(number, j, points)))
            halves[j].append(_Half(end[0], start[0], Side(number, i, points[::-1])))
    return halves


def _corner_ends(state: AtlasState, patches):
    """For each pair (i, j) the corners at which i's side toward j begins, and those at which it
    ends, as lists of (name, point).

    The three patches of a corner are taken in counter-clockwise order seen from outside. The side
    of i toward the next patch ends there, and its side toward the previous one begins there.
    """
    begins: dict[tuple, list] = {}
    finishes: dict[tuple, list] = {}
    for triple, point in sorted(state.surface_graph.cells.corners.items()):
        i, j, k = triple
        normal = sum(patches[m].normal(point[None])[0] for m in triple)
        origin = patches[i].frame.origin
        turn = np.cross(patches[j].frame.origin - origin, patches[k].frame.origin - origin)
        cycle = (i, j, k) if turn @ normal > 0 else (i, k, j)
        for first, second, third in (cycle, cycle[1:] + cycle[:1], cycle[2:] + cycle[:2]):
            finishes.setdefault((first, second), []).append((triple, point))
            begins.setdefault((first, third), []).append((triple, point))
    return begins, finishes


def _spans(curve: SharedCurve, begins, finishes, has_points: bool):
    """Pairs of named ends between which a curve bounds the cells of its two patches.

    Along the curve, corners at which it begins and corners at which it ends take turns. Where the
    first or the last one is missing, the curve runs out of both cores. With no corner at all it is
    a boundary if its edge of the graph has points.
    """
    events = [(curve.abscissa(end[1]), 0, end) for end in begins]
    events += [(curve.abscissa(end[1]), 1, end) for end in finishes]
    events.sort(key=lambda event: event[:2])
    ends = [(finish, end) for _, finish, end in events]
    runs_out = curve.half_square > 0.0 and (has_points or bool(ends))
    if runs_out and (not ends or ends[0][0]):
        ends = [(0, _free_end(curve, -1)), *ends]
    if runs_out and not ends[-1][0]:
        ends.append((1, _free_end(curve, 1)))
    spans = [(a, b) for (x, a), (y, b) in pairwise(ends) if not x and y]
    # A corner just outside the cores would begin a span that runs backward.
    return [(a, b) for a, b in spans if curve.abscissa(a[1]) < curve.abscissa(b[1])]


def _free_end(curve: SharedCurve, side: int):
    """Name and point of the end -1 or 1 at which a curve leaves both cores."""
    first, second = (patch.id for patch in curve.patches)
    return (first, second, side, "rim"), curve.free_end(side)


def _loops(patch: Patch, weight: float, halves: list[_Half], numbers) -> list[tuple[Side, ...]]:
    """The sides of one patch chained to loops, with sides on its own rim between loose ends."""

    def rim(start=None, end=None):
        return [Side(next(numbers), None, p) for p in rim_arcs(patch, weight, start, end)]

    if not halves:
        return [tuple(rim())]
    after = {half.start: half for half in halves}
    ends = {half.end for half in halves}
    loose = [half for half in halves if half.start not in ends]
    left = dict.fromkeys([*loose, *halves])
    loops = []
    while left:
        half = first = next(iter(left))
        sides: list[Side] = []
        while half in left:
            del left[half]
            sides.append(half.side)
            point = half.side.points[-1]
            if half.end in after:
                half = after[half.end]
            else:
                half = _next_around(patch, point, [h for h in loose if h in left or h is first])
                sides += rim(point, half.side.points[0])
        loops.append(tuple(sides))
    return loops


def _next_around(patch: Patch, point, loose: list[_Half]) -> _Half:
    """The first of the sides that begin on the rim, counter-clockwise after a point."""
    ends = patch.frame.to_local(np.array([point, *(half.side.points[0] for half in loose)]))
    angle = np.arctan2(ends[:, 1], ends[:, 0])
    return loose[int(np.argmin((angle[1:] - angle[0]) % (2.0 * np.pi)))]


def _owns_its_site(state: AtlasState, row: int) -> bool:
    """Whether the site of a row lies in its own cell."""
    if not state.neighbours[row]:
        return True
    rivals = power_at(state.table, sorted(state.neighbours[row]), state.table.site[row])
    return bool(-state.table.weight[row] <= rivals.min())
