"""A fitted patch as triangles and as a picture, patch.png."""

import numpy as np

from touchatlas.atlas import Surface
from touchatlas.patch import Patch
from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.look.canvas import canvas, png_of
from touchatlas.sim.recorded.recording import Recording
from touchatlas.sim.world.triangles import disc_faces


def patch_surface(patch: Patch, count: int = 24, spokes: int = 72) -> Surface:
    """Triangles of a patch within its radius, measured along the surface from its origin.

    Each spoke goes out from the origin in short steps along the tangent plane, and back onto the
    surface along the normal. Where that fails the triangles end. There are ``count`` circles.
    """
    angles = 2.0 * np.pi * np.arange(spokes) / spokes
    side = np.stack([-np.sin(angles), np.cos(angles)], axis=1) @ patch.frame.axes[:2]
    centre = _onto(patch, patch.frame.origin[None])
    circle = np.repeat(centre, spokes, axis=0)
    circles = [centre]
    for _ in range(count):
        ahead = cross(side, patch.normal(circle))
        length = np.sqrt((ahead**2).sum(axis=1, keepdims=True))
        ahead /= np.maximum(length, np.finfo(float).tiny)
        circle = _onto(patch, circle + patch.radius / count * ahead)
        circles.append(circle)
    vertices = np.concatenate(circles)
    # Beyond that Newton's method has failed.
    found = np.abs(patch.signed_distance(vertices)) < 1e-3 * patch.radius
    faces = disc_faces(count, spokes)
    faces = faces[found[faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    vertices = vertices[used]
    return Surface(
        vertices,
        faces.reshape(-1, 3),
        patch.normal(vertices),
        patch.deviation(vertices),
        np.zeros(len(used), int),
        np.zeros(len(used)),
    )


def _onto(patch: Patch, points) -> np.ndarray:
    """Points moved onto the patch along its normals, where it is not too far off."""
    for _ in range(4):
        step = np.clip(patch.signed_distance(points), -patch.radius, patch.radius)
        points = points - step[:, None] * patch.normal(points)
    return points


def png_bytes(recording: Recording, patch: Patch, surface: Surface, title: str) -> bytes:
    """The patch with its contours in its own frame, and the residuals along each contour."""
    figure = canvas(13.0, 5.5, "constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1.1, 1.0))
    figure.suptitle(title, parse_math=False)
    _draw_patch(figure, figure.add_subplot(grid[0], projection="3d"), recording, patch, surface)
    _draw_residuals(figure.add_subplot(grid[1]), recording, patch)
    return png_of(figure)


def _draw_patch(figure, axes, recording: Recording, patch: Patch, surface: Surface) -> None:
    """3-D view, coloured by predicted deviation; the contours lie on top."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    local = patch.frame.to_local(surface.vertices)
    deviation = surface.deviation[surface.faces].mean(axis=1)
    scale = ScalarMappable(Normalize(0.0, float(deviation.max()) or 1.0), "viridis")
    colours = scale.to_rgba(deviation)
    light = np.array([-0.6, -0.3, 0.74]) @ patch.frame.axes
    lit = (surface.normals @ light)[surface.faces].mean(axis=1)
    colours[:, :3] *= 0.55 + 0.45 * np.clip(lit, 0.0, 1.0)[:, None]
    axes.computed_zorder = False
    sheet = axes.plot_trisurf(*local.T, triangles=surface.faces, linewidth=0, antialiased=False)
    sheet.set_facecolor(colours)
    sheet.set_zorder(1)
    for number, contour in enumerate(recording.contours):
        points = patch.frame.to_local(contour.points)
        axes.plot(*points.T, "o-", ms=2.5, lw=1, color=f"C{number % 10}", zorder=2)
    if len(recording.scattered):
        every = -(-len(recording.scattered) // 300)
        points = patch.frame.to_local(recording.scattered[::every])
        axes.plot(*points.T, "kx", ms=4, zorder=2)
    low, high = np.array([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()]).T
    size = (high - low) / max(high[:2] - low[:2])
    stretch = max(1.0, 0.3 / size[2])
    axes.set_box_aspect((size[0], size[1], stretch * size[2]), zoom=1.1)
    axes.locator_params(nbins=5)
    digits = ".2g" if stretch < 10.0 else ".0f"
    note = f" (drawn {stretch:{digits}} x)" if stretch > 1.0 else ""
    axes.set(xlabel="along e1", ylabel="along e2", zlabel=f"height{note}")
    figure.colorbar(scale, ax=axes, label="predicted deviation", shrink=0.6, pad=0.1)


def _draw_residuals(axes, recording: Recording, patch: Patch) -> None:
    """Signed distance of the points from the patch against their place along the contour."""
    band = 2.0 * patch.noise_std
    axes.axhspan(-band, band, color="0.9", label="noise, two deviations")
    axes.axhline(0.0, color="0.6", lw=0.8)
    for number, (name, contour) in enumerate(zip(recording.names, recording.contours, strict=True)):
        offset = contour.points - patch.frame.origin
        away = np.sqrt((offset**2).sum(axis=1))
        step = np.sqrt((np.diff(contour.points, axis=0) ** 2).sum(axis=1))
        place = np.concatenate([[0.0], np.cumsum(step)])
        place -= place[away.argmin()]
        residual = np.where(away <= patch.radius, patch.signed_distance(contour.points), np.nan)
        label = name.replace("$", r"\$") if number < 8 else None
        axes.plot(place, residual, "o-", ms=3, lw=0.8, color=f"C{number % 10}", label=label)
    axes.set(xlabel="along the contour from the reference point")
    axes.set(ylabel="residual, within the patch radius")
    axes.legend(fontsize="small", ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0))
