"""Unsure rims: beside a hole the surface is kept where it is known to the tolerance."""

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.known_surface import whole_field
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces
from touchatlas.atlas.mesh.surface import Surface
from touchatlas.atlas.state import AtlasState


def without_unsure_rims(state: AtlasState, surface: Surface) -> Surface:
    """The surface without the vertices that are less sure than ``trust`` tolerances, as far as they
    are joined with a hole by others that are.

    Where no patch knows the surface, those beside it reach into the hole with what is no more than
    a guess. There they may run beside each other, and make handles that the body does not have.
    """
    loops = [np.array(loop) for loop in igl.boundary_loop_all(surface.faces)]
    limit = state.options.trust * state.tolerance
    unsure = surface.deviation > limit
    if not loops or not unsure.any():
        return surface
    # The deviation of a vertex has that of its triangles in it, which says nothing of the patches.
    unsure[unsure] = ~(whole_field(state).at(surface.vertices[unsure]).deviation <= limit)
    rim = np.unique(np.concatenate(loops))
    joined = unsure.copy()
    joined[rim] = True
    sides = np.concatenate([surface.faces[:, [i, i - 1]] for i in range(3)])
    sides = sides[joined[sides].all(axis=1)]
    size = len(unsure)
    ones = np.ones(len(sides), bool)
    _, part = connected_components(coo_array((ones, tuple(sides.T)), (size, size)), directed=False)
    unsure &= np.isin(part, part[rim])
    if not unsure.any():
        return surface
    faces, index = igl.split_nonmanifold(surface.faces[~unsure[surface.faces].any(axis=1)])
    return without_stray_pieces(state, surface.taken(index, faces))
