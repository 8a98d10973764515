"""Brep: vertices, edges and faces of a body, in numbers only, as a CAD kernel takes them.

Edges are shared by two faces and vertices by their edges. Each wire goes around its face
counter-clockwise as seen against the normal that follows from the surface's parameters.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from touchatlas.atlas.cad.edge_shapes import Curve
from touchatlas.atlas.cad.law_surfaces import LawSurface

# Tolerance of an edge that is exact, over the extent: CAD systems compute to some 1e-8 of a body's
# size. Doubled, so is the tolerance that the file states of exact edges.
LEAST_GAP = 1e-8


@dataclass(frozen=True, eq=False)
class BrepEdge:
    """An edge between two vertices.

    Parameters
    ----------
    start, end : int
        Vertices.
    curve : Curve or None
        None at the pole of a sphere and the apex of a cone.
    gap : float, length
        Largest distance of the curve from its faces.
    """

    start: int
    end: int
    curve: Curve | None
    gap: float


@dataclass(frozen=True, eq=False)
class BrepUse:
    """An edge on a face, followed forward or not, with its trace in the parameters of the face's
    surface; None on planes."""

    edge: int
    forward: bool
    trace: BSpline | None


@dataclass(frozen=True, eq=False)
class BezierFace:
    """A Bezier face, whose derivatives by u and by v make its outward normal.

    Parameters
    ----------
    control : (n + 1, n + 1, 3) float, length
        Control points; the first index belongs to u. Both parameters run from 0 to 1.
    """

    control: np.ndarray
    kind: str = "bezier"
    outward: float = 1.0


@dataclass(frozen=True, eq=False)
class BrepFace:
    """A surface with its wires.

    Parameters
    ----------
    surface : LawSurface or BezierFace
    label : int
        Id of the face of the body that it is of.
    wires : tuple of tuple of BrepUse
    """

    surface: LawSurface | BezierFace
    label: int
    wires: tuple[tuple[BrepUse, ...], ...]


@dataclass(frozen=True, eq=False)
class Brep:
    """A body.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    gaps : (v,) float, length
        Largest distance of each vertex from its edges.
    edges : tuple of BrepEdge
    faces : tuple of BrepFace
    parts : tuple of tuple of int
        Connected faces.
    closed : tuple of bool
        Whether each part has no rim.
    """

    vertices: np.ndarray
    gaps: np.ndarray
    edges: tuple[BrepEdge, ...]
    faces: tuple[BrepFace, ...]
    parts: tuple[tuple[int, ...], ...]
    closed: tuple[bool, ...]

    @cached_property
    def beside(self) -> dict[int, set[int]]:
        """The faces beside each edge."""
        out: dict[int, set[int]] = {}
        for number, face in enumerate(self.faces):
            for use in (use for wire in face.wires for use in wire):
                out.setdefault(use.edge, set()).add(number)
        return out
