"""Triangles of an atlas: those of the surface that its faces draw, mended where no law holds.

Between samples a free-form face may have zeros beside the surface, small holes and small handles.
Faces that obey laws have no small holes and handles. Amid a hole of a plate their sides may name no
face, so that a leaf stands there without a sample.
"""

import igl
import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.contouring.body_surface import (
    body_surface,
    fine_edge,
    is_smooth,
    shape_edge,
    with_curvatures,
)
from touchatlas.atlas.mesh.close_holes import close_holes
from touchatlas.atlas.mesh.close_slits import close_slits
from touchatlas.atlas.mesh.refine import refined
from touchatlas.atlas.mesh.rim_vertices import ended_at_rims
from touchatlas.atlas.mesh.small_handles import without_small_handles
from touchatlas.atlas.mesh.stray_pieces import LEAST_SIZE, without_stray_pieces
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import real
from touchatlas.patch.geometry.normal_error import SURE

# Size of the smallest handle that stays, in tolerances, and in steps of contours if that is more.
# Doubled, handles of that size are left out.
_TOLERANCES, _STEPS = 2.0, 2.0
# Memory per triangle while a surface is made, bytes, as measured, and its limit: 16 GB; doubled,
# few computers hold the surface.
_BYTES, _MOST_BYTES = 4e3, 2.0**34


def extract_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """The surface of the atlas's body as triangles.

    Small holes are closed, and pieces that no sample supports left out; where not all faces obey
    laws, small pieces and handles as well.

    Parameters
    ----------
    state : AtlasState
    edge : float, length, optional
        Edge of the cubes in which triangles are drawn, which are about as large everywhere. Without
        it they are as large as ``AtlasOptions.facets`` allows.

    Raises
    ------
    ValueError
        When the argument is no Atlas, or has no body, or the edge is no length, longer than the
        body, or too short for the memory.
    """
    body, sagitta = _body_of(state), state.options.facets * state.tolerance
    drawn = _drawn(body, sagitta) if edge is None else body_surface(body, _checked(body, edge))
    lawful = body.faces.are_lawful and not is_smooth(body)
    # What was touched of a lawful body is no leaf, however small.
    least = 0.0 if lawful else LEAST_SIZE
    surface = without_stray_pieces(drawn, body.samples.points, least)
    if edge is None:
        surface = refined(body, surface, sagitta)
    surface = with_curvatures(body, surface)
    if lawful:
        return close_holes(surface, state.rims)
    surface = ended_at_rims(surface, body)
    surface = close_slits(close_holes(surface, state.rims), state.rims)
    if not len(surface.faces) or SURE * float(np.median(surface.deviation)) > state.tolerance:
        # Handles of a surface that is hardly known are not told from others.
        return surface
    steps = _STEPS * float(np.median(body.samples.steps))
    size = max(_TOLERANCES * state.tolerance, steps)
    return without_small_handles(surface, state.rims, size)


def _drawn(body: Body, sagitta: float) -> Surface:
    """The surface of a body in cubes that show its shape. A body with edges that is not closed so
    is drawn in cubes as small as its curvature asks, which show better where it ends."""
    large, fine = shape_edge(body), fine_edge(body, sagitta)
    surface = body_surface(body, large)
    if fine >= large or not len(igl.boundary_facets(surface.faces)[0]):
        return surface
    return body_surface(body, fine)


def _body_of(state: AtlasState) -> Body:
    """The body of an atlas, if it has one."""
    if not isinstance(state, AtlasState):
        raise ValueError(f"got {type(state).__name__}; a surface is drawn of an Atlas")
    if state.body is None:
        raise ValueError(
            "the atlas has learned from no touch yet, so it has no surface; add a touch with three "
            "contours, or see in planner.stop why no touch taught anything"
        )
    return state.body


def _checked(body: Body, edge: float) -> float:
    """The edge of the cubes, if a surface of them can be made: the memory is that for two triangles
    in each cube on the square of the body's extent, which is the area of a ball."""
    if not 0.0 < real(edge) <= body.extent:
        raise ValueError(
            f"edge is {edge}; it must be a length > 0 and no more than the {body.extent:.4g} that "
            "the samples span: leave it out for a fitting one"
        )
    least = float(np.sqrt(2.0 * _BYTES / _MOST_BYTES)) * body.extent
    if edge < least:
        raise ValueError(
            f"edge is {edge:.4g}: triangles so small would take more than "
            f"{_MOST_BYTES / 2**30:.0f} GB of memory; give one of {1.1 * least:.2g} or more"
        )
    return float(edge)
