"""A jug as a scan has it: a conical wall, a lid with two scoops, a spout and a handle of bars.

It writes jug.ply (Euler characteristic 0, for its handle) into a folder, in millimetres: a closed
mesh of the outside, rough by a fifth of a thousandth of its diagonal.

    python examples/jug.py [FOLDER]
    touchatlas explore jug.ply --tolerance 0.24
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import trimesh
from vase_and_mug import meshed, write

from touchatlas.sim.command.outcome import exit_code

# The wall: radius at the bottom and at the top, and height; the rounding of all convex edges.
BOTTOM, TOP, HEIGHT, ROUNDING = 48.0, 38.0, 160.0, 1.5
# The lid: radius, thickness; its scoops: radius of the ball, depth, and place on the x axis.
LID, THICKNESS, BALL, DEPTH, SCOOP = 42.0, 7.0, 16.0, 4.0, 22.0
# The handle: radius of its bars, distance of the upright one from the axis, height of the others.
BAR, REACH, LEVELS = 6.0, 75.0, (40.0, 130.0)
# The spout: half an angle, in radians, height of its foot and how far its tip stands out.
HALF, FOOT, OUT = 0.55, 120.0, 16.0
# Width of the fillets where two parts meet, and the side of a grid cell.
FILLET, CELL = 3.0, 1.0
# The roughness: its share of the diagonal, the length of its waves, and their number.
ROUGHNESS, WAVE, WAVES = 2e-4, 6.0, 200


def rounded(*sides) -> np.ndarray:
    """(n,) distance from the intersection of solids (n,), its convex edges rounded."""
    beyond = np.stack(sides) + ROUNDING
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=0)
    return outside + np.minimum(beyond.max(axis=0), 0.0) - ROUNDING


def joined(first, second) -> np.ndarray:
    """(n,) distance from the union of two solids with a fillet: a smooth minimum (Quilez)."""
    near = np.maximum(FILLET - np.abs(first - second), 0.0) / FILLET
    return np.minimum(first, second) - 0.25 * FILLET * near**2


def bar(points, start, end) -> np.ndarray:
    """(n,) distance from a bar with round ends from one place to another."""
    along = np.subtract(end, start)
    share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(points - start - share[:, None] * along, axis=1) - BAR


def jug_field(points) -> np.ndarray:
    """(n,) about the distance from the jug, negative inside."""
    x, y, z = points.T
    r = np.hypot(x, y)
    slope = np.arctan2(BOTTOM - TOP, HEIGHT)
    cone = (r - BOTTOM) * np.cos(slope) + z * np.sin(slope)
    wall = rounded(cone, -z, z - HEIGHT)
    lid = rounded(r - LID, HEIGHT - z, z - HEIGHT - THICKNESS)
    for side in (-SCOOP, SCOOP):
        centre = np.array([side, 0.0, HEIGHT + THICKNESS + BALL - DEPTH])
        lid = np.maximum(lid, BALL - np.linalg.norm(points - centre, axis=1))
    # A cone whose tip leans outward over the wall, cut by two planes through the axis.
    lean = np.arctan2(OUT, HEIGHT - FOOT)
    front = (-x - BOTTOM + FOOT * np.tan(slope)) * np.cos(lean) - (z - FOOT) * np.sin(lean)
    sides = np.abs(y) * np.cos(HALF) - (BOTTOM + OUT + x) * np.sin(HALF)
    spout = rounded(front, sides, z - HEIGHT, FOOT - z, x)
    low, high = (np.array([0.0, 0.0, level]) for level in LEVELS)
    near, far = (np.array([REACH, 0.0, level]) for level in LEVELS)
    handle = np.min(
        [bar(points, *ends) for ends in ((low, near), (near, far), (high, far))], axis=0
    )
    whole = joined(joined(wall, spout), lid)
    return joined(whole, handle)


def rough(points, rng: np.random.Generator) -> np.ndarray:
    """(n,) heights of a rough surface of deviation one: plane waves of random directions."""
    directions = rng.normal(size=(WAVES, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    phases = rng.uniform(0.0, 2.0 * np.pi, WAVES)
    heights = [
        np.cos(block @ directions.T * (2.0 * np.pi / WAVE) + phases).sum(axis=1)
        for block in np.array_split(points, max(1, len(points) // 10_000))
    ]
    return np.concatenate(heights) / np.sqrt(0.5 * WAVES)


def jug(seed: int = 0) -> trimesh.Trimesh:
    """The jug with its roughness."""
    low = np.array([-BOTTOM - OUT, -BOTTOM, 0.0]) - 2.0 * CELL
    high = np.array([REACH + BAR, BOTTOM, HEIGHT + THICKNESS]) + 2.0 * CELL
    mesh = meshed(jug_field, low, high, CELL)
    heights = ROUGHNESS * mesh.scale * rough(mesh.vertices, np.random.default_rng(seed))
    mesh.vertices += heights[:, None] * mesh.vertex_normals
    return mesh


def main(folder: str = ".") -> None:
    write({"jug": jug()}, folder)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
