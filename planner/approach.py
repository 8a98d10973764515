"""Approach: from how far a probe may come where another side of the body is close."""

import numpy as np

from touchatlas.atlas.samples.sample_pool import SamplePool

# Cosine between the directions of approach and of an opposite sample's normal, below which its
# surface stands in the way: 45 degrees. Doubled (its distance from -1), the walls beside a slot do,
# too.
_OPPOSITE = -0.7
# Where an approach begins, over the distance of the opposite surface. Doubled, it begins there.
_MIDDLE = 0.5
# Least height of an opposite surface, over the usual distance: the back of a thin wall may be
# predicted to lie so much too low. Doubled, probes begin behind the walls of narrower slots.
_LEAST = 0.1
# Distance of an opposite sample beside the line of approach, over that along it. Doubled, what
# stands beside a touch is taken to stand above it.
_BESIDE = 3.0


def approach_within(pool: SamplePool, point, normal, usual: float) -> float:
    """Distance above a point from which the probe shall come: half-way to the nearest surface that
    faces the point, where an approach from a ``usual`` distance would begin behind it; else 0.

    Parameters
    ----------
    pool : SamplePool
        What is known of the body.
    point, normal : (3,) float, length; unit, world
        Predicted contact, and its outward normal.
    usual : float, length

    Returns
    -------
    float, length
    """
    facing = pool.normals @ normal < _OPPOSITE
    facing &= (pool.points - point) @ normal > 0.0
    offset, normals = pool.points[facing] - point, pool.normals[facing]
    # The tangent planes of samples above the point meet the line of approach at these heights.
    height = (offset * normals).sum(axis=1) / (normals @ normal)
    beside = np.linalg.norm(offset - height[:, None] * normal, axis=1)
    above = height[(height > _LEAST * usual) & (beside < _BESIDE * height)]
    nearest = float(above.min(initial=np.inf))
    return _MIDDLE * nearest if nearest < usual / _MIDDLE else 0.0
