"""Two hollow objects to explore: a turned vase with a wall of 4 mm and an upright mug of 5 mm.

It writes vase.ply (Euler characteristic 2) and mug.ply (0, for its handle) into a folder, in
millimetres. Both are closed meshes of wall, rim and inside.

    python examples/vase_and_mug.py [FOLDER]
    touchatlas explore vase.ply
"""

import sys
from pathlib import Path

import igl
import numpy as np
import trimesh
from scipy.interpolate import CubicSpline

from touchatlas.sim.command.outcome import exit_code
from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.level_set import newton_projection

# The vase: height and radius of points of the middle of its wall, from the centre of its base.
VASE_WALL, VASE_PROFILE = (
    4.0,
    [(0, 0), (0, 14), (2, 27), (10, 36), (40, 46), (80, 28), (110, 20), (130, 26)],
)
# The mug: radius of the middle of its wall, height, wall, radius of its lower corner.
RADIUS, HEIGHT, MUG_WALL, CORNER = 40.0, 90.0, 5.0, 8.0
# Its handle: height of its centre, radius of its arc and of its tube, and width of its fillet: it
# is less than half of the wall, so that the inside stays round.
MIDDLE, ARC, TUBE, FILLET = 48.0, 22.0, 5.5, 2.4
# Side of a grid cell and the step of the differences that give the slope of the field.
CELL, STEP = 0.6, 1e-4


def vase(sections: int = 256, points: int = 160) -> trimesh.Trimesh:
    """The vase, turned about the z axis: the middle of the wall moved to both sides, and a half
    circle over the rim."""
    height, radius = np.array(VASE_PROFILE, float).T
    along = np.r_[0.0, np.cumsum(np.hypot(np.diff(height), np.diff(radius)))]
    spline = CubicSpline(along, np.stack([radius, height], axis=1), bc_type="natural")
    places = np.linspace(0.0, along[-1], points)
    middle, tangent = spline(places), spline(places, 1)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    outward = 0.5 * VASE_WALL * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    turn = np.linspace(0.0, np.pi, 18)[1:-1, None]
    ahead = 0.5 * VASE_WALL * tangent[-1]
    rim = middle[-1] + np.cos(turn) * outward[-1] + np.sin(turn) * ahead
    profile = np.concatenate([middle + outward, rim, (middle - outward)[::-1]])
    profile[[0, -1], 0] = 0.0
    return trimesh.creation.revolve(profile, sections=sections)


def mug_field(points) -> np.ndarray:
    """(n,) about the distance from the mug, negative inside its wall and handle."""
    x, y, z = points.T
    r = np.hypot(x, y)
    # The solid of the middle of the wall, without end upward, its lower corner rounded.
    beyond = np.stack([r - (RADIUS - CORNER), CORNER - z])
    solid = np.hypot(*np.maximum(beyond, 0.0)) + np.minimum(beyond.max(axis=0), 0.0) - CORNER
    body = np.hypot(solid, np.maximum(z - HEIGHT, 0.0)) - 0.5 * MUG_WALL
    handle = np.hypot(np.hypot(x - RADIUS, z - MIDDLE) - ARC, y) - TUBE
    handle = np.maximum(handle, np.where(x > 0.0, RADIUS - r, RADIUS))
    # The smooth minimum of two distances (Quilez).
    near = np.maximum(FILLET - np.abs(body - handle), 0.0) / FILLET
    return np.minimum(body, handle) - 0.25 * FILLET * near**2


def meshed(distance, low, high, cell: float) -> trimesh.Trimesh:
    """The surface of a field (n, 3) to (n,) in a box, by marching cubes (Lorensen and Cline 1987)
    and Newton's steps onto the surface, with slopes by central differences."""
    axes = [np.arange(a, b, cell) + 0.123 * cell for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes[::-1], indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    values = np.concatenate([distance(block) for block in np.array_split(grid, 64)])
    vertices, faces, _ = igl.marching_cubes(values, grid, *map(len, axes), 0.0)

    def slope(points) -> tuple[np.ndarray, np.ndarray]:
        rise = [distance(points + s) - distance(points - s) for s in STEP * np.eye(3)]
        return distance(points), np.stack(rise, axis=1) / (2.0 * STEP)

    return trimesh.Trimesh(newton_projection(Field(slope, slope), vertices), faces, process=False)


def mug() -> trimesh.Trimesh:
    """The mug."""
    margin = MUG_WALL + CELL
    low, high = np.array([-RADIUS, -RADIUS, 0.0]), np.array([RADIUS + ARC + TUBE, RADIUS, HEIGHT])
    return meshed(mug_field, low - margin, high + margin, CELL)


def write(meshes: dict[str, trimesh.Trimesh], folder: str) -> None:
    """Write meshes as PLY files of their names, and say what they are."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ValueError(f"{folder} is a file, or in one; give a folder") from None
    for name, mesh in meshes.items():
        path = Path(folder) / f"{name}.ply"
        mesh.export(path)
        print(f"{path}: {len(mesh.faces)} triangles, V - E + F = {mesh.euler_number}", flush=True)


def main(folder: str = ".") -> None:
    write({"vase": vase(), "mug": mug()}, folder)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
