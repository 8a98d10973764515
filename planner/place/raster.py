"""Raster: whole parallel sections, as a measuring machine tracks them. A baseline."""

import numpy as np

from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.planner.place.choose import (
    Target,
    View,
    distance_to,
    known_places,
    open_places,
    weak_target,
)
from touchatlas.planner.probe_plan import Reason

# Largest cosine between the normals of the surface and of a section across the longest side, 20
# degrees: the tangent plane that a section alone tells is off by as much. With twice as much, the
# atlas of an ellipsoid had patches of wrong sheets, and knew 0.60 of it instead of all.
_MOST_FACING = 0.35
# Samples are of a parallel section where the cosine of the planes is this at least: all but
# rounding. With twice the distance from 1 they are the same.
_PARALLEL = 1.0 - 1e-9
# A place needs a section where its predicted deviation is more than so many scales of the atlas.
# With 0.5 ellipsoid, bottle and mouse took 1.2 to 1.5 times as many touches. Doubled, sections end
# earlier, and touches in several planes do the rest.
_UNSURE = 3.0


def raster(view: View, _: np.random.Generator | None) -> Target | None:
    """A whole section across a side of the bounding box, as far as possible from those parallel to
    it: where the surface is known badly, so that the touch begins on a known patch, or else just
    beyond what is known. At last, as with other rules, touches in several planes where a touch can
    take most of the variance.

    Sections are across the longest side, or where the surface faces that way, across the side that
    it faces least.
    """
    points, normals = _uncertain(view)
    if not len(points):
        return weak_target(view)
    pool, facing = view.atlas.membership.pool, np.abs(normals)
    longest = int((pool.points.max(axis=0) - pool.points.min(axis=0)).argmax())
    axis = np.where(facing[:, longest] <= _MOST_FACING, longest, facing.argmin(axis=1))
    away = np.zeros(len(points))
    for side in range(3):
        parallel = pool.points[np.abs(pool.across[:, side]) >= _PARALLEL]
        away[axis == side] = distance_to(parallel, points[axis == side])
    best = int(away.argmax())
    return Target(points[best], normals[best], Reason.EXPAND, np.eye(3)[axis[best]])


def _uncertain(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Known places of large deviation, or where there are none, open places that some patch
    predicts: points and normals (n, 3)."""
    known = known_places(view)
    weak = known.deviation > _UNSURE * view.atlas.scale
    if weak.any():
        return known.points[weak], known.normals[weak]
    points, _ = open_places(view)
    found = blend_of_patches(view.atlas, points)
    return points[found.known], found.normal[found.known]
