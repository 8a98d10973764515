"""Enter samples: the points of a touch's contours go into the pool, with their normals."""

import numpy as np

from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.section import contour_normals

# Least cosine between the normal of a patch and that of a contour for a sample of the patch's
# sheet: 60 degrees. Doubled, normals of a patch are those of its flat part alone.
_FACING = 0.5
# Largest distance of such a sample from the patch, in radii. Doubled, the far side of a thin wall
# has its normals.
_NEAR = 0.25


def enter_samples(
    state: AtlasState, contours: tuple[Contour, ...], outward, patch: Patch | None
) -> None:
    """Add the samples of contours to the pool; ``outward`` (3,) is the normal at their contact.

    Where they are of the sheet of the patch of their touch, their normals are those of its
    polynomial, which are more accurate than those of single contours. An arm that goes round an
    edge comes back over the same tangent plane, and is of another sheet there.
    """
    points = np.concatenate([c.points_in_plane for c in contours])
    normals = np.concatenate([contour_normals(c, outward) for c in contours])
    across = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c in contours])
    edges = np.concatenate([_is_at_edge(c) for c in contours])
    noise = np.concatenate([np.full(len(c.points), c.noise_std) for c in contours])
    if patch is not None:
        inside = _of_patch(patch, points, normals)
        normals[inside] = patch.normal(points[inside])
    sizes = np.cumsum([len(c.points) for c in contours])[:-1]
    state.rims.ends.extend(contours, np.split(normals, sizes))
    state.pool.add(points, normals, across, edges, noise)


def _of_patch(patch: Patch, points, normals) -> np.ndarray:
    """(n,) whether samples (n, 3) with normals (n, 3) are of the sheet of a patch and within its
    radius along the tangent plane."""
    local = patch.frame.to_local(points) / patch.radius
    inside = local[:, 0] ** 2 + local[:, 1] ** 2 <= 1.0
    near = points[inside]
    on = np.abs(patch.signed_distance(near)) <= _NEAR * patch.radius
    faces = (patch.normal(near) * normals[inside]).sum(axis=1) >= _FACING
    inside[inside] = on & faces
    return np.asarray(inside)


def _is_at_edge(contour: Contour) -> np.ndarray:
    """(n,) whether each point of a contour is the last one before an edge."""
    out = np.zeros(len(contour.points), bool)
    out[0], out[-1] = (end is ContourEnd.EDGE for end in contour.ends)
    return out
