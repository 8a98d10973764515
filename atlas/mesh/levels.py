"""Levels: what the deviation counts where two parallel faces lie side by side without a riser."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.field.edge_cuts import PARALLEL
from touchatlas.atlas.mesh.split_triangles import edges_of
from touchatlas.atlas.records.surface import Surface

# Part of the height between two levels by which each is unsure beside the other: the surface goes
# over from one to the other anywhere between their samples. Doubled, it is all of the height.
_HALF = 0.5


def with_unknown_risers(body: Body, surface: Surface) -> Surface:
    """A surface whose deviation is half of the height between two levels at least, at the ends of
    edges of triangles that lead from one face to a parallel one that it does not meet."""
    ends = edges_of(surface.faces)[0]
    of, normals = surface.patch[ends], surface.normals[ends]
    across = ~body.field.meet[of[:, 0], of[:, 1]]
    across &= (normals[:, 0] * normals[:, 1]).sum(axis=1) > PARALLEL
    ends, of = ends[across], of[across]
    height = np.full(len(ends), np.inf)
    for own, other in ((0, 1), (1, 0)):
        for face in np.unique(of[:, own]).tolist():
            mine = of[:, own] == face
            off = body.field.trees.distances(face, surface.vertices[ends[mine, other]])
            height[mine] = np.minimum(height[mine], np.abs(off))
    deviation = surface.deviation.copy()
    np.maximum.at(deviation, ends.ravel(), np.repeat(_HALF * height, 2))
    return replace(surface, deviation=deviation)
