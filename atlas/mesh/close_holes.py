"""Close holes: small holes of the surface are closed by triangles, counted, and sure of little."""

import igl
import numpy as np

from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.rims import Rims
from touchatlas.patch.geometry.normal_error import SURE

# Largest hole that is closed, and that the planner touches last, as a fraction of the diagonal of
# the bounding box of its piece: a longer boundary may be a true rim. Doubled, openings of a fifth
# of the object are closed.
LARGEST = 0.1
# Expected deviation of an unknown surface, in distances to the known one: a slope of six degrees.
# Doubled, the surface across a hole says that it may be twice as far off.
SLOPE = 0.1
# Least cosine between the normals of a rim and of its hole, by which slopes are divided: 60
# degrees. Doubled to 1, steep rims are taken for level ones.
_UPRIGHT = 0.5


def close_holes(surface: Surface, rims: Rims) -> Surface:
    """The surface with a fan of triangles across each small hole, and the middles of these.

    Openings of the body, whose middles lie beyond ``rims``, stay open.

    The surface must be manifold. The middle of a fan lies on the sphere through the rim of the hole
    with its normals: half as high as the tangent planes of the rim.
    """
    faces, points = surface.faces, surface.vertices
    loops = [np.array(loop) for loop in igl.boundary_loop_all(faces)] if len(faces) else []
    if not loops:
        return surface
    piece = igl.vertex_components(faces)
    size = [diameter(points[piece == piece[loop[0]]]) for loop in loops]
    small = [k for k, s in zip(loops, size, strict=True) if diameter(points[k]) <= LARGEST * s]
    closed = [(loop, _middle(surface, loop)) for loop in small]
    closed = [(k, m) for k, m in closed if not rims.beyond(m.vertices, m.normals).any()]
    if not closed:
        return surface
    middles = [middle for _, middle in closed]
    fans = [
        np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(points) + k)], axis=1)
        for k, (loop, _) in enumerate(closed)
    ]
    places = np.concatenate([middle.vertices for middle in middles])
    return surface.extended(middles, np.concatenate([faces, *fans]), places)


def diameter(points) -> float:
    """Diagonal of the bounding box of points (n, 3), length."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def error_across(half, sine) -> np.ndarray:
    """Error of a surface in the middle of a gap, exceeded once in twenty, length: at a distance
    ``half``, length, from its ends, where the surface meets the gap at an angle of a ``sine``.

    A circle that meets the gap at angles t rises above its middle by half of the gap times
    tan(t / 2) = sin t / (1 + cos t). Angles are at most right ones, and of any surface a slope of
    ``SLOPE`` is expected.
    """
    sine = np.minimum(np.abs(sine), 1.0)
    rise = sine / (1.0 + np.sqrt(1.0 - sine * sine))
    return np.asarray(half * np.maximum(SURE * SLOPE, rise))


def slope_of_rim(points, normals) -> float:
    """Mean sine of the angles at which a surface with normals (n, 3) meets the plane across a hole,
    at points (n, 3) of its rim: 0 on a plane or a saddle, 1 at the end of a tube, -1 at the bottom
    of a bore."""
    offset = points - points.mean(axis=0)
    away = np.sqrt((offset * offset).sum(axis=1))
    sines = np.einsum("ij,ij->i", normals, offset) / np.maximum(away, np.finfo(float).tiny)
    return float(sines.mean())


def _middle(surface: Surface, loop) -> Surface:
    """The vertex in the middle of a hole, without triangles."""
    rim, normals = surface.vertices[loop], surface.normals[loop]
    centre, normal = rim.mean(axis=0), normals.sum(axis=0)
    normal /= max(np.linalg.norm(normal), np.finfo(float).tiny)
    offset = rim - centre
    # On a sphere a rim at distance d has tangent planes d^2 / R above its centre, and the sphere
    # itself is d^2 / (2 R) high.
    slope = np.einsum("ij,ij->i", normals, offset)
    height = 0.5 * (slope / np.maximum(normals @ normal, _UPRIGHT)).mean()
    away = np.sqrt(np.einsum("ij,ij->i", offset, offset).mean())
    error = error_across(away, slope_of_rim(rim, normals))
    return Surface(
        (centre + height * normal)[None],
        np.zeros((0, 3), int),
        normal[None],
        np.hypot(surface.deviation[loop].max(keepdims=True), error / SURE),
        surface.patch[loop[:1]],
        surface.gaussian_curvature[loop].mean(keepdims=True),
    )
