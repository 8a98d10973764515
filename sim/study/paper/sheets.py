"""What the paper's figures draw: patches over the hull of their curves, and the body around."""

from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.patch import Patch
from touchatlas.patch.paper.curvature_on_grid import convex_hull
from touchatlas.sim.study.fits import height_error
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.triangles import disc_faces

_RINGS, _SPOKES = 45, 160
_LIGHT = np.array([0.25, -0.45, 0.86])
_DARKEST = 0.45
# Along the way from a point to the eye, in patch radii; how deep a point may lie and be seen.
_WAY, _STEPS, _SKIN = 2.0, 200, 0.01


@dataclass(frozen=True, eq=False)
class Sheet:
    """Triangles of one patch.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
    normals : (v, 3) float, unit, world
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray


def sheet_of(patch: Patch, points) -> Sheet:
    """A patch over the convex hull of the projection of world points: the paper's domain D."""
    angles = 2.0 * np.pi * np.arange(_SPOKES) / _SPOKES
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    hull = convex_hull(patch.frame.to_local(points)[:, :2]).equations
    toward = ways @ hull[:, :2].T
    with np.errstate(divide="ignore"):
        rim = np.where(toward > 0.0, -hull[:, 2] / toward, np.inf).min(axis=1)
    fractions = np.arange(1, _RINGS + 1) / _RINGS
    flat = (fractions[:, None, None] * rim[:, None] * ways).reshape(-1, 2)
    flat = np.concatenate([np.zeros((1, 2)), flat])
    local = np.column_stack([flat, np.zeros(len(flat))])
    local[:, 2] = -height_error(patch, patch.frame.to_world(local))
    vertices = patch.frame.to_world(local)
    return Sheet(vertices, disc_faces(_RINGS, _SPOKES), patch.normal(vertices))


def draw_triangles(axes, vertices, faces, colours, **style) -> None:
    """Triangles (f, 3) of one or of many colours."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    # Smoothed edges would leave seams between the triangles.
    pieces = Poly3DCollection(vertices[faces], linewidths=0.0, **{"antialiased": False} | style)
    pieces.set_facecolor(colours)
    axes.add_collection3d(pieces)


def lit(colour, normals) -> np.ndarray:
    """(f, 4) a colour in the light that falls on triangles; both sides are bright."""
    from matplotlib.colors import to_rgba

    shade = _DARKEST + (1.0 - _DARKEST) * np.abs(normals @ _LIGHT)
    colours = np.tile(to_rgba(colour), (len(normals), 1))
    colours[:, :3] *= np.clip(shade, 0.0, 1.0)[:, None]
    return colours


def draw_sheet(axes, vertices, faces, colour, **style) -> None:
    """Triangles of one colour, lit."""
    draw_triangles(
        axes,
        vertices,
        faces,
        lit(colour, igl.per_face_normals(vertices, faces, np.zeros(3))),
        **style,
    )


def draw_body(axes, body: ImplicitObject) -> None:
    """An object in grey, as far as it faces the eye."""
    vertices, faces = body.mesh(body.tolerance)
    seen = igl.per_face_normals(vertices, faces, np.zeros(3)) @ eye(axes) > 0.0
    draw_sheet(axes, vertices, faces[seen], "0.8", zorder=1)
    frame_on(axes, vertices, 0.95)


def eye(axes) -> np.ndarray:
    """(3,) unit vector toward the eye."""
    elevation, azimuth = np.deg2rad([axes.elev, axes.azim])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return np.cos(elevation) * level + np.sin(elevation) * np.array([0.0, 0.0, 1.0])


def frame_on(axes, points, zoom: float) -> None:
    """Equal scales on all axes, with the points in sight."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=zoom)


def before_patch(patch: Patch, points_local, way) -> np.ndarray:
    """(n,) whether local points are seen from the direction ``way`` (3,), above the patch."""
    steps = np.linspace(0.0, _WAY * patch.radius, _STEPS)[:, None, None]
    along = points_local + steps * way
    height = patch.signed_distance(patch.frame.to_world(along.reshape(-1, 3)))
    height = height.reshape(along.shape[:2])
    within = (along[..., :2] ** 2).sum(axis=2) <= patch.radius**2
    return ~(within & (height < -_SKIN * patch.radius)).any(axis=0)
