"""surface.png: the surface of a run from four sides, coloured by error, the truth below."""

import igl
import numpy as np

from touchatlas.sim.look.canvas import canvas, png_of

# Views as azimuth and elevation, degrees.
_VIEWS = ((35.0, 25.0), (125.0, 25.0), (215.0, -25.0), (305.0, 25.0))


def surface_picture(title: str, surface, error, truth, tolerance: float, unit: str = "") -> bytes:
    """A PNG with four views of the surface, and of the truth from the same sides.

    Parameters
    ----------
    title : str
    surface, truth : pairs of vertices (n, 3) and faces (f, 3)
    error : (v,) float, length
        Distance of each vertex of the surface from the truth.
    tolerance : float, length
        Error at which the colours end.
    unit : str
        Of lengths.
    """
    grey = np.tile(np.array([0.72, 0.74, 0.78]), (len(truth[0]), 1))
    rows = {"surface": (surface, error), "truth": (truth, grey)}
    return _picture(
        title, rows, truth[0], tolerance, f"distance from the truth{f' ({unit})' if unit else ''}"
    )


def deviation_picture(title: str, surface, deviation, tolerance: float) -> bytes:
    """A PNG with four views of a surface, vertices (n, 3) and faces (f, 3), coloured by its
    predicted deviation (n,), length, up to a tolerance."""
    rows = {"surface": (surface, deviation)}
    return _picture(title, rows, surface[0], tolerance, "predicted deviation")


def _picture(title: str, rows, shown, tolerance: float, label: str) -> bytes:
    """Rows of views of surfaces, by their names, each with colours (n, 3) or lengths (n,) at its
    vertices; the views have the vertices ``shown`` (n, 3) in the middle."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    height = 0.6 + 2.5 * len(rows)
    figure = canvas(11.5, height)
    top = 1.0 - 0.4 / height
    axes = figure.add_axes((0.025, 0.0, 0.875, top))
    scale = ScalarMappable(Normalize(0.0, tolerance), "viridis")
    box = np.array([shown.min(axis=0), shown.max(axis=0)])
    half = 1.05 * max(_half_extent(shown, view, box.mean(axis=0)) for view in _VIEWS)
    images = []
    for body, values in rows.values():
        colours = values if np.ndim(values) == 2 else scale.to_rgba(values)[:, :3]
        images.append(np.hstack(_views(body[0], body[1], colours, box, half)))
    axes.imshow(np.vstack(images), interpolation="bilinear")
    axes.set(xticks=[])
    middles = 100.0 + 200.0 * np.arange(len(rows))
    axes.set_yticks(middles, list(rows), rotation=90, va="center")
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    figure.suptitle(title, parse_math=False)
    beside = figure.add_axes((0.92, 0.15 * top, 0.016, 0.7 * top))
    figure.colorbar(scale, cax=beside, extend="max").set_label(label)
    return png_of(figure)


def _half_extent(vertices, view, centre) -> float:
    """Half of the extent of vertices (n, 3) as seen from one side, length."""
    right, up, _ = _camera(*view)
    return float(np.abs((vertices - centre) @ np.stack([right, up], axis=1)).max())


def _views(vertices, faces, colours, box, half: float) -> list[np.ndarray]:
    """Images (200, 200, 3) of triangles by parallel rays, one for each view."""
    # Rays of the tree are in single precision, which suits a diagonal of a thousand.
    diagonal = 1e3
    unit = max(float(np.sqrt(((box[1] - box[0]) ** 2).sum())), np.finfo(float).tiny) / diagonal
    # To the right, up and toward the eye.
    to_light = np.array([-0.35, 0.45, 0.82])
    scaled = np.ascontiguousarray((vertices - box.mean(axis=0)) / unit)
    tree = igl.AABB()
    tree.init(scaled, faces)
    side = half / unit * np.linspace(-1.0, 1.0, 200)
    across, upward = (x.reshape(-1, 1) for x in np.meshgrid(side, -side))
    images = []
    for azimuth, elevation in _VIEWS:
        right, up, toward = _camera(azimuth, elevation)
        eyes = across * right + upward * up + diagonal * toward
        away = np.tile(-toward, (len(eyes), 1))
        face, _, (u, v) = _first_hits(tree, scaled, faces, eyes, away)
        image, hit = np.ones((len(eyes), 3)), np.flatnonzero(face >= 0)
        corners = faces[face[hit]]
        weights = np.stack([1.0 - u[hit] - v[hit], u[hit], v[hit]], axis=1)
        light = _shade(scaled[corners], to_light @ np.array([right, up, toward]))
        image[hit] = light[:, None] * (weights[:, :, None] * colours[corners]).sum(axis=1)
        images.append(np.clip(image, 0.0, 1.0).reshape(200, 200, 3))
    return images


def _first_hits(tree, vertices, faces, origins, directions):
    """Face that each ray meets first, or -1; the distance; and its two barycentric coordinates."""
    face, distance, places = tree.intersect_ray_first(vertices, faces, origins, directions)
    return np.where(np.isfinite(distance), face, -1), distance, places.T


def _shade(corners, light) -> np.ndarray:
    """(n,) brightness of triangles (n, 3, 3), the same from behind: open surfaces are seen so."""
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    length = np.sqrt((normals**2).sum(axis=1))
    cosine = np.abs(normals @ light) / np.where(length > 0.0, length, 1.0)
    return 0.4 + 0.6 * cosine


def _camera(azimuth: float, elevation: float):
    """Unit vectors to the right, up, and toward the eye."""
    a, e = np.deg2rad([azimuth, elevation])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(toward, right), toward
