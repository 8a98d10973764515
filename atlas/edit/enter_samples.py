"""Enter samples: the points of a touch's contours go into the pool, with their normals."""

import numpy as np

from touchatlas.atlas.patches.normal_equations import of_patch
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.section import contour_normals


def enter_samples(state: AtlasState, table: PatchTable, row: int, contours) -> np.ndarray:
    """Add the samples of the contours to the pool; returns their indices.

    Where they are of the sheet of the patch ``row`` their normals are those of its polynomial,
    which are more accurate than those of single contours. An arm that goes round an edge comes back
    over the same tangent plane, and is of another sheet there.
    """
    frame_normal = table.axes[row, 2]
    points = np.concatenate([c.points_in_plane for c in contours])
    normals = np.concatenate([contour_normals(c, frame_normal) for c in contours])
    across = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c in contours])
    rows = np.array([row])
    upward = table.surface(rows, table.scaled_local(rows, points))[1][0]
    upward = upward / np.sqrt((upward**2).sum(axis=1))[:, None] @ table.axes[row]
    inside = of_patch(table, rows, points, normals)[0]
    edges = np.concatenate([_is_at_edge(c) for c in contours])
    normals = np.where(inside[:, None], upward, normals)
    state.rims.ends.extend(
        contours, np.split(normals, np.cumsum([len(c.points) for c in contours])[:-1])
    )
    return state.membership.pool.add(points, normals, across, edges)


def _is_at_edge(contour: Contour) -> np.ndarray:
    """(n,) whether each point of a contour is the last one before an edge."""
    out = np.zeros(len(contour.points), bool)
    out[0], out[-1] = (end is ContourEnd.EDGE for end in contour.ends)
    return out
