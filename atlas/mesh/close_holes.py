"""Close holes: small holes of the surface are closed by triangles, counted, and sure of little."""

from dataclasses import replace

import igl
import numpy as np

from touchatlas.atlas.mesh.surface import Surface

# Largest hole that is closed, as a fraction of the diagonal of the surface's bounding box: a longer
# boundary may be a true rim. Doubled, openings of a tenth of the object are closed.
_LARGEST = 0.1
# Expected deviation of an unknown surface, in distances to the known one: a slope of six degrees.
# Doubled, the surface across a hole says that it may be twice as far off.
_SLOPE = 0.1


def close_holes(surface: Surface) -> Surface:
    """The surface with a fan of triangles across each small hole, and their number.

    The surface must be manifold. The middle of a fan lies on the sphere through the rim of the hole
    with its normals: half as high as the tangent planes of the rim.
    """
    faces, points = surface.faces, surface.vertices
    size = np.linalg.norm(np.ptp(points, axis=0)) if len(points) else 0.0
    loops = [np.array(loop) for loop in igl.boundary_loop_all(faces)] if len(faces) else []
    small = [loop for loop in loops if _diameter(points[loop]) <= _LARGEST * size]
    if not small:
        return surface
    middles = [_middle(surface, loop) for loop in small]
    fans = [
        np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(points) + k)], axis=1)
        for k, loop in enumerate(small)
    ]
    columns = {
        name: np.concatenate([getattr(surface, name), [middle[name] for middle in middles]])
        for name in middles[0]
    }
    return replace(
        surface, faces=np.concatenate([faces, *fans]), closed_holes=len(small), **columns
    )


def _diameter(points) -> float:
    """Diagonal of the bounding box of points (n, 3), length."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _middle(surface: Surface, loop) -> dict[str, np.ndarray]:
    """Values of the vertex in the middle of a hole, by the names of a Surface."""
    rim, normals = surface.vertices[loop], surface.normals[loop]
    centre, normal = rim.mean(axis=0), normals.sum(axis=0)
    normal /= max(np.linalg.norm(normal), np.finfo(float).tiny)
    offset = rim - centre
    # On a sphere a rim at distance d has tangent planes d^2 / R above its centre, and the sphere
    # itself is d^2 / (2 R) high.
    slope = np.einsum("ij,ij->i", normals, offset)
    upright = np.maximum(normals @ normal, 0.5)
    away = np.sqrt(np.einsum("ij,ij->i", offset, offset).mean())
    deviation = np.hypot(surface.deviation[loop].max(), _SLOPE * away)
    return {
        "vertices": centre + 0.5 * (slope / upright).mean() * normal,
        "normals": normal,
        "deviation": deviation,
        "patch": surface.patch[loop[0]],
        "gaussian_curvature": surface.gaussian_curvature[loop].mean(),
    }
