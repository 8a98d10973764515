"""Meshes with sharp edges or rims to explore.

They are a box, a cylinder, a hexagonal prism, a step, a slot, a T-slot, two fingers and a tube; a
box with waves on its top and a handle with flat ends, whose free-form faces obey no law; a wedge of
20 degrees and a thin disc with a rim of a radius of 0.3, around which no contour turns; and half a
ball and a ball with five round holes, which are open. The tube has an Euler characteristic of 0,
the ball with holes one of -3.

It writes each as a PLY file of its name into a folder, in millimetres.

    python examples/sharp_bodies.py [FOLDER]
    touchatlas explore cylinder.ply
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import trimesh
from vase_and_mug import write

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
# A block with a T-slot, as a machine table has.
TSLOT = np.array(
    [[-30, 0], [30, 0], [30, 34], [6, 34], [6, 22], [16, 22], [16, 12]]
    + [[-16, 12], [-16, 22], [-6, 22], [-6, 34], [-30, 34]],
    float,
)
TSLOT_TRIANGLES = np.array(
    [[0, 1, 6], [0, 6, 7], [1, 2, 5], [1, 5, 6], [2, 3, 4], [2, 4, 5]]
    + [[0, 7, 8], [0, 8, 11], [11, 8, 9], [11, 9, 10]]
)
# Two fingers of 20 and 19 with a gap of 4 between them.
FINGERS = np.array(
    [[-30, 0], [30, 0], [30, 34], [2, 34], [2, 10], [-2, 10], [-2, 35], [-30, 35]], float
)
# Axes and half angles, in degrees, of the holes of a ball.
HOLES = [
    *(((0, 0, -1), 25.0), ((1, 0, 0), 15.0), ((-1, 1, 0), 20.0)),
    *(((0, -1, 1), 12.0), ((-1, -1, 1), 18.0)),
]

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


def ball_without(caps) -> trimesh.Trimesh:
    """A ball of radius 30 without caps: axes and half angles in degrees."""
    mesh = trimesh.creation.icosphere(subdivisions=6, radius=30.0)
    kept = np.ones(len(mesh.faces), bool)
    for axis, angle in caps:
        along = mesh.triangles_center @ (np.asarray(axis) / np.linalg.norm(axis)) / 30.0
        kept &= along < np.cos(np.deg2rad(angle))
    mesh.update_faces(kept)
    mesh.remove_unreferenced_vertices()
    return mesh


def bodies() -> dict[str, trimesh.Trimesh]:
    """The meshes by name."""
    return {
        "box": trimesh.creation.box(extents=[60.0, 60.0, 60.0]),
        "cylinder": trimesh.creation.cylinder(radius=20.0, height=50.0, sections=SECTIONS),
        "prism": trimesh.creation.cylinder(radius=25.0, height=40.0, sections=6),
        "step": trimesh.creation.extrude_triangulation(PROFILE, TRIANGLES, height=30.0),
        "slot": trimesh.creation.extrude_triangulation(SLOT, SLOT_TRIANGLES, height=40.0),
        "T-slot": trimesh.creation.extrude_triangulation(TSLOT, TSLOT_TRIANGLES, height=40.0),
        "fingers": trimesh.creation.extrude_triangulation(FINGERS, SLOT_TRIANGLES, height=30.0),
        "tube": trimesh.creation.annulus(r_min=12.0, r_max=20.0, height=30.0, sections=SECTIONS),
        "wavy": wavy_box(),
        "handle": handle(),
        "wedge": trimesh.creation.extrude_triangulation(WEDGE, [[0, 1, 2]], height=40.0),
        "disc": disc(),
        "half_ball": ball_without([([0, 0, -1], 90.0)]),
        "holed_ball": ball_without(HOLES),
    }


def main(folder: str = ".") -> None:
    meshes = bodies()
    for mesh in meshes.values():
        mesh.merge_vertices()
    write(meshes, folder)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
