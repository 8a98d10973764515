"""Reach: whether a straight pin can touch a place without passing through what is known."""

import numpy as np

from touchatlas.atlas.atlas import Atlas

# Distance between points of the pin's axis, in radii of the pin. Doubled, a wall as thick as the
# pin passes between two points.
_SPACING = 0.5
# How far a sample may be inside the pin, in its radii, or in sizes of what is known if that is
# less: the contact is uncertain. Doubled, a pin reaches where it is a fifth too thick.
_INSIDE = 0.1
# How far inside the surface the axis must be to enter the body, in its deviations: its own contact
# may lie inside by as much as the surface is uncertain. Doubled, pins pass walls that are known
# badly.
_SURELY = 3.0
# Largest radius that is told from a flat end, in sizes of what is known. Doubled, a millionth of
# the size may be between the two.
_FLAT = 1e6
# Most points of the axis. Doubled, a pin thinner than a thousandth of its length takes twice as
# long, and thinner walls stop it.
_MOST_POINTS = 1000


def is_reachable(atlas: Atlas, point, normal, radius: float, length: float) -> bool:
    """Whether a pin with a round tip, along the outward normal of its contact, is clear of the
    known surface.

    The axis from the centre of the tip outward must not enter the body, and no sample may be nearer
    to it than the radius. What is not known is taken to be free.

    Parameters
    ----------
    atlas : Atlas
    point, normal : (3,) float, length; unit, world
        Of the contact.
    radius, length : float, length
        Of the pin. A pin of no length reaches everything.
    """
    if not length > radius:
        return True
    if atlas.body is None:
        return True
    offset = atlas.pool.points - point
    # Nothing is known farther away.
    size = float(np.sqrt((offset * offset).sum(axis=1).max()))
    size += atlas.body.reach
    radius = min(radius, _FLAT * size)
    length = min(length, radius + size)
    step = max(_SPACING * radius, length / _MOST_POINTS)
    heights = np.append(np.arange(radius, length, step), length)
    found = atlas.blend(point + heights[:, None] * normal)
    if (found.known & (found.distance < -_SURELY * found.deviation)).any():
        return False
    along = np.clip(offset @ normal, radius, length)
    beside = offset - along[:, None] * normal
    least = radius - _INSIDE * min(radius, size)
    return bool((np.einsum("ij,ij->i", beside, beside) >= least**2).all())
