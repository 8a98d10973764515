"""Meshes with sharp edges to explore: box, cylinder, hexagonal prism, step, slot and tube; a box
with waves on its top and a handle with flat ends, whose free-form faces obey no law; and a wedge of
20 degrees and a thin disc with a rim of a radius of 0.3, around which no contour turns.

It writes box.ply, cylinder.ply, prism.ply, step.ply, slot.ply, tube.ply, wavy.ply, handle.ply,
wedge.ply and disc.ply into a folder, in millimetres. All are closed; the tube has an Euler
characteristic of 0.

    python examples/sharp_bodies.py [FOLDER]
    touchatlas explore cylinder.ply
"""

import sys
from pathlib import Path

import numpy as np
import trimesh

from touchatlas.sim.command.outcome import exit_code

# Triangles of a circle: 256 sides of a circle of radius 20 are within 0.0015 of it.
SECTIONS = 256
# Profile of the step, counter-clockwise, and its triangles: two of the low part, three of the high.
PROFILE = np.array([[0, 0], [30, 0], [60, 0], [60, 40], [30, 40], [30, 20], [0, 20]], float)
TRIANGLES = np.array([[0, 1, 5], [0, 5, 6], [1, 2, 3], [1, 3, 5], [5, 3, 4]])
# Those of two blocks on a base with a slot of 12 x 15 between them.
SLOT = np.array(
    [[-30, 0], [30, 0], [30, 25], [6, 25], [6, 10], [-6, 10], [-6, 25], [-30, 25]], float
)
SLOT_TRIANGLES = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]])

# A wedge that is 60 long.
HALF = 60.0 * np.tan(np.deg2rad(10.0))
WEDGE = np.array([[0.0, 0.0], [60.0, -HALF], [60.0, HALF]])


def wavy_box() -> trimesh.Trimesh:
    """A box of 60 x 40 x 30 with waves of 4 on its top."""
    mesh = trimesh.creation.box(extents=[60.0, 40.0, 30.0])
    for _ in range(6):
        mesh = mesh.subdivide()
    x, y, z = mesh.vertices.T
    rise = 4.0 * np.sin(x / 9.0 + 0.5) * np.cos(y / 8.0 + 0.3)
    mesh.vertices[:, 2] += (0.5 + z / 30.0) * rise
    return mesh


def handle() -> trimesh.Trimesh:
    """A turned handle of 80 between two flat ends, three-sided by a twelfth of its radius."""
    height = np.linspace(0.0, 80.0, 161)
    radius = 14.0 + 5.0 * np.sin(height / 11.0) + 3.0 * np.cos(height / 6.0)
    profile = np.vstack([[0.0, 0.0], np.column_stack([radius, height]), [0.0, 80.0]])
    mesh = trimesh.creation.revolve(profile, sections=SECTIONS)
    x, y, z = mesh.vertices.T
    mesh.vertices[:, :2] *= 1.0 + np.cos(3.0 * np.arctan2(y, x) + z / 30.0)[:, None] / 12.0
    return mesh


def disc() -> trimesh.Trimesh:
    """An ellipsoid with half axes of 60, 50 and 4."""
    mesh = trimesh.creation.icosphere(subdivisions=6)
    mesh.apply_scale([60.0, 50.0, 4.0])
    return mesh


def bodies() -> dict[str, trimesh.Trimesh]:
    """The meshes by name."""
    return {
        "box": trimesh.creation.box(extents=[60.0, 60.0, 60.0]),
        "cylinder": trimesh.creation.cylinder(radius=20.0, height=50.0, sections=SECTIONS),
        "prism": trimesh.creation.cylinder(radius=25.0, height=40.0, sections=6),
        "step": trimesh.creation.extrude_triangulation(PROFILE, TRIANGLES, height=30.0),
        "slot": trimesh.creation.extrude_triangulation(SLOT, SLOT_TRIANGLES, height=40.0),
        "tube": trimesh.creation.annulus(r_min=12.0, r_max=20.0, height=30.0, sections=SECTIONS),
        "wavy": wavy_box(),
        "handle": handle(),
        "wedge": trimesh.creation.extrude_triangulation(WEDGE, [[0, 1, 2]], height=40.0),
        "disc": disc(),
    }


def main(folder: str = ".") -> None:
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ValueError(f"{folder} is a file, or in one; give a folder") from None
    for name, mesh in bodies().items():
        mesh.merge_vertices()
        mesh.export(Path(folder) / f"{name}.ply")
        print(f"{name}.ply: Euler characteristic {mesh.euler_number}")


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
