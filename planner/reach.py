"""Reach: whether a straight pin can touch a place without passing through what is known."""

import numpy as np

from touchatlas.atlas.atlas import Atlas

# Distance between points of the pin's axis, and the least distance of a sample from it, in radii of
# the pin. The first doubled, a wall as thick as the pin passes between two points; the second is
# below 1 by what the contact is uncertain.
_SPACING, _CLEAR = 0.5, 0.9
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
    step = max(_SPACING * radius, length / _MOST_POINTS)
    heights = np.append(np.arange(radius, length, step), length)
    found = atlas.blend(point + heights[:, None] * normal)
    if (found.known & (np.nan_to_num(found.distance) < 0.0)).any():
        return False
    offset = atlas.membership.pool.points - point
    along = np.clip(offset @ normal, radius, length)
    beside = offset - along[:, None] * normal
    return bool((np.einsum("ij,ij->i", beside, beside) >= (_CLEAR * radius) ** 2).all())
