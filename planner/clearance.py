"""Clearance: what is known of the body leaves a probe room on its way to a contact."""

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.options import PlannerOptions, styli_of


def clear_height(atlas: Atlas, point, normal, usual: float) -> float:
    """Height above a point from which the probe shall come: half-way to the nearest surface that
    faces the point, where an approach from a ``usual`` distance would begin behind it; else 0.

    Parameters
    ----------
    atlas : Atlas
    point, normal : (3,) float, length; unit, world
        Predicted contact, and its outward normal.
    usual : float, length

    Returns
    -------
    float, length
    """
    pool = atlas.pool
    facing = pool.normals @ normal < -atlas.levels.facing
    facing &= (pool.points - point) @ normal > 0.0
    offset, normals = pool.points[facing] - point, pool.normals[facing]
    # The tangent planes of samples above the point meet the line of approach at these heights.
    height = (offset * normals).sum(axis=1) / (normals @ normal)
    aside = np.linalg.norm(offset - height[:, None] * normal, axis=1)
    # The back of a thin wall may be predicted a little too low. What stands next to the line of
    # approach, seen from its foot more than 72 degrees off it, is not above it.
    above = height[(height > 0.1 * usual) & (aside < 3.0 * height)]
    nearest = float(above.min(initial=np.inf))
    return 0.5 * nearest if nearest < 2.0 * usual else 0.0


def pin_is_clear(atlas: Atlas, point, normal, options: PlannerOptions) -> bool:
    """Whether the straight pin of the options, with a round tip, in one of its directions, is clear
    of the known surface: along the outward normal of its contact, or in those of fixed styli.

    The axis from the centre of the tip outward must not enter the body, and no sample may be nearer
    to it than the radius. What is not known is taken to be free. A pin of no length reaches
    everything.

    Parameters
    ----------
    atlas : Atlas
    point, normal : (3,) float, length; unit, world
        Of the contact; of the centre, where the samples are centres.
    options : PlannerOptions
    """
    radius, length = options.pin_radius, options.pin_length
    if not length > radius or atlas.body is None:
        return True
    # Pins pass contacts, whatever the samples are.
    point, pool = point - atlas.tip_radius * normal, atlas.without_tip.pool
    offset = pool.points - point
    # Nothing is known farther away. A tip a million times as large is flat.
    size = float(np.sqrt((offset * offset).sum(axis=1).max())) + atlas.body.reach
    radius = min(radius, 1e6 * size)
    length = min(length, radius + size)
    axes = styli_of(options.styli) if options.styli else normal[None]
    return any(
        _is_clear(atlas, point + radius * normal, axis, radius, length, size) for axis in axes
    )


def _is_clear(atlas: Atlas, centre, axis, radius: float, length: float, size: float) -> bool:
    """Whether a pin along an axis (3,), unit, from the centre of its tip is clear of what is known
    within a size, length."""
    # Two points in each radius see a wall as thick as the pin; a thousand are enough for thin pins.
    step = max(0.5 * radius, 1e-3 * length)
    heights = np.append(np.arange(0.0, length - radius, step), length - radius)
    found = atlas.blend(centre + heights[:, None] * axis)
    if (found.known & (found.distance < -atlas.levels.sure * found.deviation)).any():
        return False
    offset = atlas.without_tip.pool.points - centre
    aside = offset - np.clip(offset @ axis, 0.0, length - radius)[:, None] * axis
    # The contact is uncertain: samples may be a tenth of the radius inside the pin.
    least = radius - 0.1 * min(radius, size)
    return bool((np.einsum("ij,ij->i", aside, aside) >= least**2).all())
