"""Boundary: where two pieces meet, and whether that is a sharp edge or a smooth rim."""

from dataclasses import dataclass
from enum import Enum

from touchatlas.atlas.edges.blunt_edges import BluntEdge
from touchatlas.atlas.edges.edge_curves import CurvePoints


class EdgeKind(Enum):
    """What lies between two pieces."""

    SHARP_CONVEX = "sharp convex"
    SHARP_CONCAVE = "sharp concave"
    SMOOTH_RIM = "smooth rim"
    ARTIFICIAL = "artificial"

    @property
    def sharp(self) -> bool:
        """Whether the normals differ."""
        return self in (EdgeKind.SHARP_CONVEX, EdgeKind.SHARP_CONCAVE)

    @property
    def sign(self) -> float:
        """1 for a convex edge, where the farther out of two faces decides; -1 for others."""
        return 1.0 if self is EdgeKind.SHARP_CONVEX else -1.0


@dataclass(frozen=True, eq=False)
class Boundary:
    """Where two pieces meet.

    Parameters
    ----------
    first, second : int
        Labels, the lower first.
    kind : EdgeKind
    curve : CurvePoints
        Points of the boundary, in no order.
    angle : float, rad
        Median angle between the normals of both pieces at the boundary.
    gap : float, length
        Root mean square of the difference of their distances.
    blunt : BluntEdge or None
        How a sharp edge is rounded.
    """

    first: int
    second: int
    kind: EdgeKind
    curve: CurvePoints
    angle: float
    gap: float
    blunt: BluntEdge | None = None
