"""FaceLayout: faces with their surfaces, bounded by chains of points that lie on both faces.

A chain runs from node to node. A face that goes around an axis is cut along a seam, at which its
loops get nodes.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.cad.face_regions import BEYOND, Use
from touchatlas.atlas.cad.law_surfaces import LawSurface
from touchatlas.atlas.cad.shared_points import shared_points

# Directions about an axis that are tried for a seam. Doubled, seams pass between more holes.
_DIRECTIONS = 64


class NotWritten(Exception):
    """A face that cannot be written by its law, in words."""


class NoName(NotWritten):
    """A face whose law has no name in STEP, whatever its triangles are."""


@dataclass(eq=False)
class PlacedChain:
    """Points on two faces.

    Parameters
    ----------
    left, right : int
        Regions; ``BEYOND`` at a rim.
    points : (k, 3) float, length, world
    start, end : int
        Nodes.
    is_free : bool
        Whether it is closed and may begin anywhere.
    """

    left: int
    right: int
    points: np.ndarray
    start: int
    end: int
    is_free: bool


@dataclass(eq=False)
class FaceLayout:
    """Faces, chains and nodes.

    Parameters
    ----------
    surfaces : list of LawSurface
        Of each region.
    loops : list of list of list of Use
        Of each region.
    chains : list of PlacedChain
    nodes : list of (3,) float, length, world
    seams : dict
        For each region with a seam, its nodes at the lower and at the upper end of it; None stands
        for a pole.
    """

    surfaces: list[LawSurface]
    loops: list[list[list[Use]]]
    chains: list[PlacedChain]
    nodes: list[np.ndarray]
    seams: dict[int, tuple[int | None, int | None]]

    def around(self, chain: PlacedChain) -> list[LawSurface]:
        """The surfaces on both sides of a chain."""
        return [self.surfaces[r] for r in (chain.left, chain.right) if r != BEYOND]

    def loop_points(self, loop) -> np.ndarray:
        """(k, 3) points of a loop in order; the last is the first."""
        parts = [self.chains[c].points[:: 1 if forward else -1] for c, forward in loop]
        return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])

    def node_at(self, loop, place: int, plane: LawSurface) -> int:
        """A new node where step ``place`` of the points of a loop crosses a plane."""
        for c, forward in loop:
            steps = len(self.chains[c].points) - 1
            if place < steps:
                return self._split(c, place if forward else steps - 1 - place, plane)
            place -= steps
        raise AssertionError("a loop has as many steps as its chains")

    def _split(self, number: int, step: int, plane: LawSurface) -> int:
        chain = self.chains[number]
        a, b = chain.points[step : step + 2]
        x, y = (plane.at(p[None])[0][0] for p in (a, b))
        point = a + (x / (x - y) if x != y else 0.5) * (b - a)
        point = shared_points([*self.around(chain), plane], point[None])[0]
        before, after = chain.points[: step + 1], chain.points[step + 1 :]
        self.nodes.append(point)
        node = len(self.nodes) - 1
        if chain.is_free:
            points = np.concatenate([point[None], after, before[1:], point[None]])
            self.chains[number] = PlacedChain(chain.left, chain.right, points, node, node, False)
            return node
        pair = (chain.left, chain.right)
        self.chains[number] = PlacedChain(
            *pair, np.concatenate([before, point[None]]), chain.start, node, False
        )
        rest = np.concatenate([point[None], after])
        self.chains.append(PlacedChain(*pair, rest, node, chain.end, False))
        both = [(number, True), (len(self.chains) - 1, True)]
        for region in pair:
            if region != BEYOND:
                self.loops[region] = [_replaced(loop, number, both) for loop in self.loops[region]]
        return node


def _replaced(loop, number: int, both) -> list[Use]:
    """A loop with two chains in the place of one."""
    out: list[Use] = []
    for c, forward in loop:
        if c != number:
            out.append((c, forward))
        elif forward:
            out += both
        else:
            out += [(d, False) for d, _ in reversed(both)]
    return out


def cut_seams(layout: FaceLayout, inner) -> None:
    """Cut faces that go around an axis along a seam; ``inner`` are points (k, 3) of each region."""
    for region, surface in enumerate(layout.surfaces):
        if surface.periodic and layout.loops[region]:
            _cut_seam(layout, region, surface, inner[region])


def _cut_seam(layout: FaceLayout, region: int, surface: LawSurface, inner) -> None:
    loops = [layout.loop_points(loop) for loop in layout.loops[region]]
    if surface.kind == "sphere":
        largest = max((_area(points) for points in loops), key=lambda a: a @ a)
        surface = surface.about(surface.outward * largest, _across(largest))
    angles = [surface.parameters(points)[:, 0] for points in loops]
    turns = [round((np.unwrap(u)[-1] - u[0]) / (2.0 * np.pi)) for u in angles]
    # Loops are counter-clockwise seen from outside, turns are about the axis.
    turns = [int(surface.outward) * t for t in turns]
    if not any(turns):
        if surface.kind == "sphere":
            raise NotWritten("the bounds of a sphere go around none of its axes")
        layout.surfaces[region] = _turned(surface, _widest_gap(surface, inner))
        return
    ways = sorted(turns, reverse=True)
    ways = [t for t in ways if t]
    # A loop that goes around once ends at a pole: the upper one is missing where it turns left.
    if ways != [1, -1] and (len(ways) != 1 or surface.pole(ways[0]) is None):
        raise NotWritten(f"the bounds of a {surface.kind} go around it {ways} times")
    surface = _turned(surface, _seam_angle(angles, turns, _taken(layout, region, surface)))
    layout.surfaces[region] = surface
    low, high = (
        _seam_node(layout, region, surface, turns.index(way)) if way in turns else None
        for way in (1, -1)
    )
    layout.seams[region] = (low, high)


def _taken(layout: FaceLayout, region: int, surface: LawSurface) -> np.ndarray:
    """(k,) directions about the axis of the nodes of a region that are not free to move."""
    chains = [layout.chains[c] for loop in layout.loops[region] for c, _ in loop]
    nodes = [layout.nodes[n] for c in chains if not c.is_free for n in (c.start, c.end)]
    return surface.parameters(np.array(nodes).reshape(-1, 3))[:, 0]


def _seam_node(layout: FaceLayout, region: int, surface: LawSurface, which: int) -> int:
    """The node at which a loop crosses the seam."""
    loop = layout.loops[region][which]
    u = surface.parameters(layout.loop_points(loop))[:, 0]
    place = int(np.abs(np.diff(u)).argmax())
    half = LawSurface("plane", surface.origin, surface.axes[[2, 0, 1]])
    return layout.node_at(loop, place, half)


def _turned(surface: LawSurface, angle: float) -> LawSurface:
    """The same surface with u = 0 where ``angle`` is now."""
    x, y, axis = surface.axes
    return surface.about(axis, np.cos(angle) * x + np.sin(angle) * y)


def _seam_angle(angles, turns, taken) -> float:
    """The direction that each loop that goes around crosses once, and no other one crosses; as far
    as may be from the directions ``taken`` (k,) of nodes."""
    best, farthest = None, -1.0
    for angle in 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS:
        crossings = [(np.abs(np.diff((u - angle) % (2.0 * np.pi))) > np.pi).sum() for u in angles]
        away = np.abs((taken - angle + np.pi) % (2.0 * np.pi) - np.pi).min(initial=np.pi)
        if crossings == [abs(t) for t in turns] and away > farthest:
            best, farthest = float(angle), away
    if best is None:
        raise NotWritten("a face around an axis has no place for its seam")
    return best


def _widest_gap(surface: LawSurface, inner) -> float:
    """The middle of the widest range of angles in which a face has no point (k, 3)."""
    u = np.sort(surface.parameters(inner)[:, 0])
    gaps = np.diff(np.append(u, u[0] + 2.0 * np.pi))
    widest = int(gaps.argmax())
    return float(u[widest] + 0.5 * gaps[widest])


def _area(points) -> np.ndarray:
    """(3,) area vector of a closed polyline (k, 3), length^2."""
    offset = points - points.mean(axis=0)
    return np.asarray(0.5 * np.cross(offset[:-1], offset[1:]).sum(axis=0))


def _across(vector) -> np.ndarray:
    """(3,) the world axis most nearly orthogonal to a vector."""
    return np.asarray(np.eye(3)[np.abs(vector).argmin()])
