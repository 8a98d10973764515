"""A closed smooth body as shapes of the CAD kernel: Bezier faces that share edges, checked."""

from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.bezier.bezier_brep import bezier_brep, largest_turn
from touchatlas.atlas.cad.bezier.bezier_faces import bezier_faces
from touchatlas.atlas.cad.bezier.coarse_quads import coarse_triangles, three_quads
from touchatlas.atlas.cad.bezier.near_surface import NearSurface
from touchatlas.atlas.cad.bezier.occ_bezier import bezier_solids
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_kernel import NamedShape, refusals
from touchatlas.atlas.cad.occ_parts import is_valid
from touchatlas.atlas.records.surface import Surface

# Largest distance of a face from the surface, in bounds: where the field jumps faces are farther
# than the bound. Doubled, bodies whose surface is torn are written smooth.
_WORST = 4.0


@dataclass(frozen=True, eq=False)
class BezierShapes:
    """Shapes of the kernel, one a part.

    Parameters
    ----------
    shapes : list of NamedShape
    gap : float, length
        Largest distance of a face from the surface, at the points of a grid on each.
    turn : float, rad
        Largest angle between the normals of neighbours at an edge.
    """

    shapes: list[NamedShape]
    gap: float
    turn: float


def bezier_shapes(body: Body, surface: Surface, bound: float) -> BezierShapes:
    """Shapes of a body that is one free-form face.

    Parameters
    ----------
    body : Body
    surface : Surface
        Its triangles, mended.
    bound : float, length
        Largest distance of the faces from the surface where it is smooth.

    Raises
    ------
    NotWritten
        The surface is open or torn, or the kernel refuses the faces, in words.
    """
    if not len(surface.faces) or len(igl.boundary_facets(surface.faces)[0]):
        raise NotWritten("the surface is open")
    at = NearSurface(body.field, surface, bound).at
    quads = three_quads(*coarse_triangles(surface))
    tree, errors = bezier_faces(*quads, at, bound)
    worst, words = float(np.max(errors)), body.faces.faces[0].words
    if worst > _WORST * bound:
        how = f"misses the surface by {worst:.3g}" if np.isfinite(worst) else "is folded"
        raise NotWritten(f"the surface is rough: a smooth face {how}")
    with refusals():
        shapes = bezier_solids(bezier_brep(tree), words)
        if not all(is_valid(one.shape) for one in shapes):
            raise NotWritten("the CAD kernel finds the shape invalid")
    return BezierShapes(shapes, worst, largest_turn(tree))
