"""Points that lie on several surfaces at once, by Newton's method."""

import numpy as np

# Steps; each about squares the error, from a thousandth of the radius of curvature. Doubled,
# nothing changes.
_STEPS = 8
# Least singular value of the unit normals of surfaces that intersect, no unit: the sine of 3
# degrees. Tangent surfaces are met half-way. Doubled, blunt edges are met half-way too.
LEAST_SINE = 0.05


def shared_points(surfaces, points) -> np.ndarray:
    """Points (n, 3) moved onto all surfaces, by steps of least length.

    Where more than three surfaces meet, or two are tangent, the sum of the squared distances is
    least.

    Parameters
    ----------
    surfaces : sequence of LawSurface
    points : (n, 3) float, length, world
    """
    points = np.array(points, float)
    for _ in range(_STEPS):
        found = [surface.at(points) for surface in surfaces]
        distance = np.stack([d for d, _ in found], axis=1)
        normals = np.stack([n for _, n in found], axis=1)
        inverse = np.linalg.pinv(normals, rcond=LEAST_SINE)
        points -= (inverse @ distance[..., None])[..., 0]
    return points


def farthest(surfaces, points) -> float:
    """Largest distance of points (n, 3) from any of the surfaces, length."""
    return max(float(np.abs(surface.at(points)[0]).max()) for surface in surfaces)
