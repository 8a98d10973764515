"""Pictures in three dimensions: arrays as objects of a ``k3d`` plot, which a notebook shows."""

from typing import TYPE_CHECKING, Any

import numpy as np

from touchatlas.patch.geometry.arrays import frozen_array

if TYPE_CHECKING:
    from k3d.plot import Plot

# Colours as k3d takes them: of what was touched and tracked, where to touch next, what is open.
TOUCHED, TRACKED, PLANNED, OPEN = 0xD1495B, 0x4A5560, 0xEDAE49, 0x19C3E6
_PLAIN = 0x7FA7C9
# Twelve colours that are told apart, taken in turn by the ids of faces.
FACE_COLOURS = np.array(
    [
        [78, 121, 167], [242, 142, 43], [89, 161, 79], [225, 87, 89], [118, 183, 178],
        [237, 201, 72], [176, 122, 161], [255, 157, 167], [156, 117, 95], [186, 176, 172],
        [134, 188, 182], [211, 114, 149],
    ],
    np.uint8,
)  # fmt: skip


def new_plot(unit: str = "") -> "Plot":
    """An empty plot whose axes are named, with a unit if one is given."""
    import k3d

    unit = f" ({unit})" if unit else ""
    plot = k3d.plot(
        axes=[f"{axis}{unit}" for axis in "xyz"],
        camera_up_axis="z",
        axes_helper=0,
        time_interpolation=False,
        grid_color=0xC8CDD3,
        label_color=0x808890,
    )
    # The menu would hide a third of a small picture.
    plot.menu_visibility = False
    return plot


def packed(rgb) -> np.ndarray:
    """(n,) colours as k3d takes them, of red, green and blue (n, 3) from 0 to 255."""
    rgb = np.asarray(rgb, np.uint32)
    return np.asarray(rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2], np.uint32)


def face_colours(face) -> np.ndarray:
    """(n,) colours, as k3d takes them, of ids (n,) of faces."""
    return packed(FACE_COLOURS[np.asarray(face) % len(FACE_COLOURS)])


def add_mesh(plot: "Plot", vertices, faces, name: str, **looks: Any) -> None:
    """Add triangles (f, 3) between vertices (v, 3), length; ``looks`` go to ``k3d.mesh``."""
    import k3d

    looks = {"color": _PLAIN, "flat_shading": False, "side": "double"} | looks
    vertices, faces = np.asarray(vertices, np.float32), np.asarray(faces, np.uint32)
    plot += k3d.mesh(vertices, faces, name=name, **looks)


def add_surface(plot: "Plot", surface, colour: str, tolerance: float | None = None) -> None:
    """Add a Surface coloured by its ``deviation``, from 0 to the tolerance or its largest, or by
    its ``face``."""
    from k3d import matplotlib_color_maps

    if colour not in ("deviation", "face"):
        raise ValueError(f"got {colour!r} for the colour; give 'deviation' or 'face'")
    # k3d multiplies both.
    looks: dict[str, Any] = {"colors": face_colours(surface.patch), "color": 0xFFFFFF}
    if colour == "deviation":
        most = float(surface.deviation.max(initial=0.0)) if tolerance is None else tolerance
        looks = {
            "attribute": np.asarray(surface.deviation, np.float32),
            "color_map": matplotlib_color_maps.Viridis,
            "color_range": [0.0, most or 1.0],
        }
    add_mesh(plot, surface.vertices, surface.faces, f"surface, {colour}", **looks)


def add_points(plot: "Plot", points, size: float, name: str, colour: int) -> None:
    """Add points (n, 3) as balls of a diameter, length; nothing where there are none."""
    import k3d

    if len(points):
        points = np.asarray(points, np.float32)
        plot += k3d.points(points, point_size=size, color=colour, shader="3d", name=name)


def add_curves(plot: "Plot", curves, width: float, name: str, colour: int) -> None:
    """Add curves, each (k, 3) points in order, length; nothing where there are none."""
    import k3d

    if curves:
        points, pairs = joined_curves(curves)
        looks = {"indices_type": "segment", "shader": "mesh", "color": colour, "width": width}
        plot += k3d.lines(points.astype(np.float32), pairs, name=name, **looks)


def joined_curves(curves) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of all curves, and pairs (m, 2) of indices of those that follow each other.

    >>> joined_curves([np.zeros((2, 3)), np.ones((3, 3))])[1].tolist()
    [[0, 1], [2, 3], [3, 4]]
    """
    if not len(curves):
        return np.zeros((0, 3)), np.zeros((0, 2), np.uint32)
    starts = np.concatenate([[0], np.cumsum([len(curve) for curve in curves])])
    first = [np.arange(a, b - 1) for a, b in zip(starts, starts[1:], strict=False)]
    pairs = np.concatenate(first)[:, None] + np.array([0, 1])
    return np.concatenate(curves), pairs.astype(np.uint32)


def plane_corners(point, normal, across, half: float) -> np.ndarray:
    """(4, 3) corners of a square of a plane about a point (3,), length, with unit ``normal`` (3,)
    and an edge along ``across`` (3,), another direction than the normal.

    >>> plane_corners(np.zeros(3), np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), 1.0)[0].tolist()
    [-1.0, -1.0, 0.0]
    """
    first = frozen_array(across, (3,), "across") - (across @ normal) * normal
    first = first / np.sqrt(first @ first)
    second = np.cross(normal, first)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return np.array([point + half * (i * first + j * second) for i, j in corners])
