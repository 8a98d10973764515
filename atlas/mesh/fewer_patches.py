"""As few patches of a body as its tolerance asks."""

from dataclasses import replace

import igl
import numpy as np

from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.contouring.body_surface import MOST, body_surface, coarse_edge, is_smooth
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces
from touchatlas.atlas.surfaces.fewer import fewer_sextics

# Edge of the cubes in which points of the surface are drawn, over the radius of its patches.
# Doubled, small patches are not told from what they leave out.
_EDGE = 1.0 / 7.0


def with_fewer_patches(known: KnownBody, tolerance: float) -> KnownBody:
    """What is known, with a free-form body of fewer patches that is mostly off by no more than a
    quarter of a tolerance (length): see ``fewer_sextics``. The body has its rims already.

    Beside openings the patches of samples tell where the surface is no longer known, so that these
    stay. Those of a body with sharp turns cut each other, and stay as well.
    """
    body = known.body
    if body is None or known.is_few or not is_smooth(body):
        return known
    surface = body.field.trees.free_form(0)
    if surface is None or len(surface.pairs):
        return known
    edge = max(min(coarse_edge(body), _EDGE * surface.radius), body.extent / MOST)
    # Patches follow from samples alone, whether or not a probe passed through their surface.
    whole = body.with_air(np.zeros((0, 2, 3)))
    drawn = without_stray_pieces(body_surface(whole, edge), body.samples.points)
    if not len(drawn.faces):
        return known
    ends = np.zeros(len(drawn.vertices) + len(body.seeds), bool)
    ends[igl.boundary_facets(drawn.faces)[0].ravel()] = True
    # Between drawn points a narrow bend shows at samples alone: the tip of a bottle was off by 0.4
    # tolerances.
    at = whole.field.at(body.seeds)
    feet = body.seeds - at.distance[:, None] * at.normal
    points = np.concatenate([drawn.vertices, feet])
    normals = np.concatenate([drawn.normals, at.normal])
    deviations = np.concatenate([drawn.deviation, at.deviation])
    count = len(drawn.vertices)
    fewer = fewer_sextics(surface, points, normals, deviations, ends, count, edge, tolerance)
    if fewer is surface:
        return known
    return replace(known, is_few=True, body=body.with_surface(fewer))
