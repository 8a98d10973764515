"""replay.html: a run as one page that needs no network, drawn by k3d."""

import json
import re
import struct
import zlib
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.resources import files

import igl
import numpy as np

from touchatlas.atlas.scene import (
    FACE_COLOURS,
    OPEN,
    PLANNED,
    TOUCHED,
    TRACKED,
    add_mesh,
    joined_curves,
    new_plot,
    packed,
)
from touchatlas.patch.words import count_of
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.look.frames import MOST_VERTICES, Frames, Mesh, clustered

# Vertices of all surfaces, at most: with some sixteen bytes a vertex the page stays below 10 MB.
_MOST_IN_ALL = 400_000
_KINDS = {"uint8": "u1", "uint16": "u2", "uint32": "u4"}
_TRUTH, _WAY = 0x9AA5B1, 0x8E6BBF


def replay_bytes(
    title: str,
    frames: Frames,
    tolerance: float,
    unit: str,
    truth: ClosestPoints | None,
    seen: tuple[np.ndarray, np.ndarray] | None,
    curves: str,
    face_words: Sequence[str] = (),
) -> bytes:
    """The page: a slider over touches, the surface as it was known, and curves.

    Parameters
    ----------
    title : str
    frames : Frames
        With the finished surface.
    tolerance : float, length
        Where the colours of deviations and errors end.
    unit : str
        Of lengths.
    truth : ClosestPoints, optional
        Of the true surface, which errors are measured from.
    seen : pair of vertices (v, 3), length, and faces (f, 3), optional
        The true surface as it is shown, translucent.
    curves : str
        Pictures that stand beside, as HTML.
    face_words : sequence of str
        What each face of the finished surface is.
    """
    run = run_text(title, frames, tolerance, unit, truth, face_words)
    return page_bytes(frames, unit, seen, run, curves)


def run_text(
    title: str, frames: Frames, tolerance: float, unit: str, truth, face_words=(), live=False
) -> str:
    """What the page shows, as text: see ``replay_bytes``. A ``live`` one is asked for again."""
    meshes = _within_budget(frames.meshes)
    low, extent = _box(frames, meshes)
    arrays = _mesh_arrays(meshes, tolerance, truth) | _touch_arrays(frames)
    for name, array in arrays.items():
        if array.dtype == float:
            arrays[name] = np.clip((array - low) / extent * 65535, 0, 65535).astype(np.uint16)
    layers = ["contacts", "contours", "way", "planes", "open places"]
    modes = ["deviation", *(["error"] if truth is not None else []), "face", "patch"]
    about = {
        "title": title,
        "live": live,
        "touches": len(frames.touches),
        "steps": max(len(frames.touches) - 1, 1),
        "tolerance": f"{tolerance:.4g} {unit}".strip(),
        "words": _words(frames, live),
        "modes": modes,
        "layers": [*layers, *(["truth"] if truth is not None else [])],
        "low": low.tolist(),
        "scale": extent / 65535,
        "palettes": {"scale": _viridis(), "face": packed(FACE_COLOURS).tolist()},
        "legend": [
            [name, f"#{colour:06x}"]
            for name, colour in (
                ("contacts", TOUCHED),
                ("contours", TRACKED),
                ("planes of the next touch", PLANNED),
                ("way of the probe", _WAY),
                ("open places", OPEN),
                *([("the true object", _TRUTH)] if truth is not None else []),
            )
        ],
        "face_words": [escape(words) for words in face_words[:8]],
    }
    return _packed(about, arrays)


def _within_budget(meshes: list[Mesh]) -> list[Mesh]:
    """As many of the surfaces as the page has room for, evenly, with the last."""
    total = sum(len(mesh.vertices) for mesh in meshes)
    every = max(int(np.ceil(total / _MOST_IN_ALL)), 1)
    return meshes[::-1][::every][::-1]


def _box(frames: Frames, meshes: list[Mesh]) -> tuple[np.ndarray, float]:
    """Low corner (3,) and edge of a cube about all that is drawn, length."""
    every = [mesh.vertices for mesh in meshes] + frames.planes()
    every += [touch.contact[None] for touch in frames.touches] + frames.open_places
    every += [contour.points for touch in frames.touches for contour in touch.contours]
    points = np.concatenate([np.reshape(p, (-1, 3)) for p in every]) if every else np.zeros((1, 3))
    low = points.min(axis=0).astype(float)
    return low, float(np.ptp(points, axis=0).max()) or 1.0


def _mesh_arrays(meshes: list[Mesh], tolerance: float, truth) -> dict[str, np.ndarray]:
    """The surfaces, one after the other, and where each begins."""
    no = np.zeros((0, 3))
    none = [Mesh(0, no, no.astype(int), no[:, 0], no[:, 0].astype(int), no[:, 0].astype(int))]
    every = meshes or none
    vertices = np.concatenate([mesh.vertices for mesh in every]).astype(float)
    out = {
        "mesh_touch": np.array([mesh.touch for mesh in meshes], np.uint32),
        "vertex_from": _starts([len(mesh.vertices) for mesh in meshes]),
        "face_from": _starts([len(mesh.faces) for mesh in meshes]),
        "vertices": vertices,
        "faces": np.concatenate([mesh.faces for mesh in every]).astype(np.uint16),
        "deviation": _bytes(np.concatenate([mesh.deviation for mesh in every]), tolerance),
        "face": _colours([mesh.face for mesh in every]),
        "patch": _colours([mesh.patch for mesh in every]),
    }
    if truth is not None:
        error = truth(vertices)[0] if len(vertices) else np.zeros(0)
        out["error"] = _bytes(error, tolerance)
    return out


def _touch_arrays(frames: Frames) -> dict[str, np.ndarray]:
    """Contacts, contours, ways, planes and open places, touch by touch."""
    curves = [[c.points for c in touch.contours] for touch in frames.touches]
    points, pairs = joined_curves([*frames.scans, *(curve for some in curves for curve in some)])
    before = sum(map(len, frames.scans)), sum(len(curve) - 1 for curve in frames.scans)
    ways = [
        np.array([touch.contact, touch.contact]) if touch.way is None else touch.way
        for touch in frames.touches
    ]
    # A touch that met nothing has its planned place for a contact.
    met = [touch.contact for touch in frames.touches if touch.contours]
    planes = frames.planes()
    most = max((len(vertices) for vertices in planes), default=0)
    squares = np.arange(most, dtype=np.uint32).reshape(-1, 4)
    return {
        "contacts": np.reshape(met, (-1, 3)).astype(float),
        "contact_from": _starts([bool(touch.contours) for touch in frames.touches]),
        "contours": points.astype(float),
        "contour_from": before[0] + _starts([sum(map(len, some)) for some in curves]),
        "pairs": pairs.astype(np.uint32),
        "pair_from": before[1] + _starts([sum(len(c) - 1 for c in some) for some in curves]),
        "ways": np.reshape(ways, (-1, 3)).astype(float),
        "planes": np.reshape(np.concatenate(planes) if planes else [], (-1, 3)).astype(float),
        "plane_from": _starts([len(vertices) for vertices in planes]),
        "plane_faces": squares[:, [0, 1, 2, 0, 2, 3]],
        "open": np.concatenate([np.zeros((0, 3)), *frames.open_places]).astype(float),
        "open_from": _starts([len(some) for some in frames.open_places]),
    }


def _starts(counts: list[int]) -> np.ndarray:
    """Where each of several parts begins, and where the last ends."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32)


def _bytes(lengths, tolerance: float) -> np.ndarray:
    """Lengths (n,) from 0 to the tolerance as numbers from 0 to 255."""
    return np.asarray(np.clip(np.asarray(lengths) / tolerance, 0.0, 1.0) * 255, np.uint8)


def _colours(ids: list[np.ndarray]) -> np.ndarray:
    """Numbers of the colours that ids have, one after the other."""
    return np.asarray(np.concatenate(ids) % len(FACE_COLOURS), np.uint8)


def _words(frames: Frames, live: bool) -> list[str]:
    """What is said of each moment."""
    count = len(frames.touches)
    words = [f"touch {i + 1} of {count}: {said}" for i, said in enumerate(frames.words)]
    return [
        *words,
        f"{count_of(count, 'touch')}{' so far' if live else ': the finished surface'}",
    ]


def _viridis() -> list[int]:
    from matplotlib import colormaps

    return packed(colormaps["viridis"](np.arange(256), bytes=True)[:, :3]).tolist()


def _packed(about: dict, arrays: dict[str, np.ndarray]) -> str:
    """A dictionary and arrays as text: the length of the dictionary as JSON, it, the arrays."""
    places, offset = {}, 0
    for name, array in arrays.items():
        places[name] = [_KINDS[array.dtype.name], offset, array.size]
        offset += array.nbytes
    head = json.dumps(about | {"arrays": places}).encode()
    body = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays.values())
    return b64encode(zlib.compress(struct.pack("<I", len(head)) + head + body, 6)).decode()


def _scene(low: np.ndarray, high: np.ndarray, unit: str, seen):
    """The plot with an object for each layer; the page fills them. ``low`` and ``high`` (3,) are
    corners of a box about all of them, length."""
    import k3d

    plot, extent = new_plot("" if unit == "file's unit" else unit), float(np.max(high - low))
    # Camera and grid are given, so that the first picture is already that of the whole scene: one
    # from amidst the objects takes a computer without a graphics processor half a minute.
    plot.camera_auto_fit = plot.grid_auto_fit = False
    # The labels begin at its corner.
    step = 10.0 ** np.floor(np.log10(extent / 5.0))
    plot.grid = [*(np.floor(low / step) * step).tolist(), *(np.ceil(high / step) * step).tolist()]
    plot.camera = _camera(low, high, plot.camera_fov)
    # All but the surface and the truth are empty until then, and k3d takes no empty arrays.
    dot, no = np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint32)
    add_mesh(plot, dot, no, "surface", visible=False, color=0xFFFFFF)
    add_mesh(plot, dot, no, "planes", visible=False, color=PLANNED, opacity=0.3)
    for name, colour, size in (("contacts", TOUCHED, 0.018), ("open places", OPEN, 0.012)):
        looks = {"point_size": size * extent, "shader": "3d", "color": colour}
        plot += k3d.points(dot, name=name, visible=False, **looks)
    for name, colour, width in (("contours", TRACKED, 0.0025), ("way", _WAY, 0.005)):
        looks = {"indices_type": "segment", "shader": "mesh", "color": colour}
        looks |= {"width": width * extent, "radial_segments": 4}
        # A tube of no length has no direction.
        line = np.array([[0, 0, 0], [extent, 0, 0]], np.float32), np.array([[0, 1]], np.uint32)
        plot += k3d.lines(*line, name=name, visible=False, **looks)
    if seen is not None:
        kept, faces = clustered(seen[0], seen[1], MOST_VERTICES)
        vertices = np.asarray(seen[0][kept], float)
        # A little within, so that the surface hides it where it is known. The triangles of two
        # sides that clustering made one have no normal together.
        normals = np.nan_to_num(igl.per_vertex_normals(vertices, faces))
        vertices = vertices - 0.004 * extent * normals
        add_mesh(plot, vertices, faces, "truth", color=_TRUTH, opacity=0.25)
    return plot


def _in_sight(frames: Frames, seen) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) of a box about the body and what was touched of it, length."""
    every = [touch.contact[None] for touch in frames.touches]
    every += [mesh.vertices for mesh in frames.meshes[-1:]] + ([] if seen is None else [seen[0]])
    points = np.concatenate(every).astype(float) if every else np.zeros((1, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    return low, np.maximum(high, low + (float(np.ptp(points, axis=0).max()) or 1.0) * 1e-3)


def _camera(low: np.ndarray, high: np.ndarray, angle: float) -> list[float]:
    """Place, target and upward direction of a camera that sees a box, with an angle in degrees."""
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    direction = np.array([0.55, -0.75, 0.36])
    place = centre + 1.2 * radius / np.sin(np.radians(0.5 * angle)) * direction
    return [*place.tolist(), *centre.tolist(), 0.0, 0.0, 1.0]


def page_bytes(frames: Frames, unit: str, seen, run: str, curves: str) -> bytes:
    """The page that k3d makes, with our controls and curves about its picture; ``seen`` is the true
    surface as it is shown: see ``replay_bytes``."""
    folder = files("touchatlas.sim.look")
    low, high = _in_sight(frames, seen)
    script, layout = ((folder / name).read_text("utf-8") for name in ("page.js", "page.html"))
    plot = _scene(low, high, unit, seen)
    page = plot.get_snapshot(compression_level=4, additional_js_code=script)
    # k3d writes the time of day there.
    page = re.sub(r"<title>.*?</title>", "<title>touchatlas</title>", page, count=1)
    canvas = '<div id="canvasTarget"></div>'
    # Without an icon of its own a page that is served asks for one.
    head = '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    head += '<link rel="icon" href="data:,">\n</head>'
    data = f'<script type="text/plain" id="run">{run}</script>'
    if page.count(canvas) != 1:
        raise ValueError("this version of k3d makes another page; install k3d 3.2")
    page = page.replace(canvas, layout.replace("[CURVES]", curves) + data, 1)
    return page.replace("</head>", head, 1).encode()
