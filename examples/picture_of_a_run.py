"""A run as a picture: the surface by faces, with its samples, and by predicted deviation; progress.

touchatlas explore bottle && python examples/picture_of_a_run.py runs/bottle-0 bottle.png
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from touchatlas.atlas import Atlas, Surface, extract_surface, load_atlas
from touchatlas.sim.command.outcome import exit_code

# The view: elevation and azimuth, degrees, and the direction to the eye.
ELEVATION, AZIMUTH = 12.0, -60.0
EYE = np.array(
    [
        np.cos(np.deg2rad(ELEVATION)) * np.cos(np.deg2rad(AZIMUTH)),
        np.cos(np.deg2rad(ELEVATION)) * np.sin(np.deg2rad(AZIMUTH)),
        np.sin(np.deg2rad(ELEVATION)),
    ]
)


def draw(axes, surface: Surface, colours, title: str) -> None:
    """Triangles in parallel projection, shaded by their normals."""
    light = surface.normals[surface.faces].mean(axis=1) @ np.array([0.4, -0.7, 0.6])
    shade = (0.45 + 0.55 * np.clip(light, 0.0, 1.0))[:, None]
    faces = Poly3DCollection(surface.vertices[surface.faces], linewidths=0)
    faces.set_facecolor(np.clip(colours[:, :3] * shade, 0.0, 1.0))
    axes.add_collection3d(faces)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), title=title)
    axes.set_box_aspect(high - low)
    axes.set_proj_type("ortho")
    axes.view_init(ELEVATION, AZIMUTH)
    axes.set_axis_off()


def draw_samples(axes, atlas: Atlas) -> None:
    """Samples that face the eye, as points: those of a contour lie along a line."""
    towards = atlas.pool.normals @ EYE > 0.0
    # Else matplotlib draws what lies farther off on average first, here all of the samples.
    axes.computed_zorder = False
    axes.plot(*atlas.pool.points[towards].T, "k.", ms=0.6, zorder=10)


def main(run: str | None = None, out: str = "run.png") -> None:
    if run is None:
        print("give the folder of a run; see the first lines of this file")
        return
    if Path(out).is_dir():
        raise ValueError(f"{out} is a folder; give the path of a picture")
    atlas = load_atlas(Path(run) / "atlas.npz")
    surface = extract_surface(atlas, edge=float(np.ptp(atlas.pool.points, axis=0).max()) / 110)
    figure = plt.figure(figsize=(11, 4.6), layout="constrained")
    face = surface.patch[surface.faces[:, 0]]
    title = f"{len(np.unique(face))} faces of {len(atlas)} patches, and samples"
    axes = figure.add_subplot(131, projection="3d")
    draw(axes, surface, plt.get_cmap("tab20")(face * 7 % 20), title)
    draw_samples(axes, atlas)
    deviation = surface.deviation[surface.faces].mean(axis=1)
    scale = deviation / np.quantile(deviation, 0.98)
    colours = plt.get_cmap("viridis")(np.clip(scale, 0.0, 1.0))
    title = f"predicted deviation, up to {np.quantile(deviation, 0.98):.2g}"
    draw(figure.add_subplot(132, projection="3d"), surface, colours, title)
    with open(Path(run) / "steps.csv") as file:
        rows = list(csv.DictReader(file))
    axes = figure.add_subplot(133)
    axes.plot(
        [float(r["tracked_length"]) for r in rows],
        [float(r["predicted_coverage"]) for r in rows],
        label="known to the tolerance, as predicted",
    )
    seen = [r for r in rows if r["coverage"]]
    axes.plot(
        [float(r["tracked_length"]) for r in seen],
        [float(r["coverage"]) for r in seen],
        "o-",
        ms=3,
        label="true coverage",
    )
    axes.set(xlabel="tracked length", ylim=(0, 1.03))
    axes.legend(loc="lower right")
    figure.savefig(out, dpi=100)
    print(f"wrote {out}")


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
