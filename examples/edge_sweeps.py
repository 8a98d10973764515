"""Bodies whose edges become blunt, walls thin, or steps low: what is found, and at what cost.

    python examples/edge_sweeps.py [rounding | wall | step] [SIZE ...]

A box of 60 x 40 x 30 mm has edges of a radius, the same box a wall for its height, and a step of
two heights a difference of them; each SIZE is in tolerances. Every body is explored until its
planner stops, or for 120 touches.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

from touchatlas.sim import RunOptions, make_object, run_exploration
from touchatlas.sim.command.outcome import exit_code

SIDES = np.array([60.0, 40.0, 30.0])
# A thousandth of the diagonal, as the tolerance of a mesh is.
TOLERANCE = 1e-3 * float(np.linalg.norm(SIDES))
MOST_TOUCHES = 120
SWEEPS = {
    "rounding": (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0),
    "wall": (10.0, 30.0, 100.0, 300.0),
    "step": (0.5, 1.0, 2.0, 5.0, 20.0, 50.0),
}


def rounded_box(radius: float) -> trimesh.Trimesh:
    """The convex hull of a ball in each corner; its chords are within 6e-4 radii of the balls."""
    if radius == 0.0:
        return trimesh.creation.box(extents=SIDES)
    ball = trimesh.creation.icosphere(4, radius).vertices
    corners = trimesh.creation.box(extents=SIDES - 2.0 * radius).vertices
    return trimesh.convex.convex_hull((ball[:, None] + corners).reshape(-1, 3))


def wall(thickness: float) -> trimesh.Trimesh:
    """A plate of a thickness."""
    return trimesh.creation.box(extents=[*SIDES[:2], thickness])


def step(height: float) -> trimesh.Trimesh:
    """A box one half of which is higher."""
    x, z = SIDES[0], SIDES[2]
    profile = np.array([[0, 0], [x / 2, 0], [x, 0], [x, z], [x / 2, z], [x / 2, z - height]])
    profile = np.vstack([profile, [0, z - height]])
    triangles = np.array([[0, 1, 5], [0, 5, 6], [1, 2, 3], [1, 3, 5], [5, 3, 4]])
    return trimesh.creation.extrude_triangulation(profile, triangles, height=SIDES[1])


BODIES = {"rounding": rounded_box, "wall": wall, "step": step}


def deviation_there(surface, found: dict) -> float:
    """The deviation that the surface predicts where its error is largest, length."""
    side = max(("accuracy", "completeness"), key=lambda one: found[f"{one}_max"])
    place = np.array(found[f"{side}_max_place"])
    return float(surface.deviation[((surface.vertices - place) ** 2).sum(axis=1).argmin()])


def row_of(mesh: trimesh.Trimesh, folder: Path) -> str:
    """One row of the table: what an exploration of a mesh found."""
    mesh.export(folder / "body.ply")
    body = make_object(str(folder / "body.ply"))
    options = RunOptions(tolerance=TOLERANCE, noise=0.2 * TOLERANCE, max_touches=MOST_TOUCHES)
    run = run_exploration(body, folder / "run", options, force=True)
    found = run.numbers
    both = [
        max(found[f"{side}_{what}"] for side in ("accuracy", "completeness")) / TOLERANCE
        for what in ("p95", "max")
    ]
    closed = "yes" if found["watertight"] else "no"
    cells = [
        found["touches"],
        "yes" if found["met"] else "no",
        closed,
        f"{found['euler_characteristic']} ({found['true_euler_characteristic']})",
        found["faces"],
        *(f"{value:.3g}" for value in both),
        f"{deviation_there(run.surface, found) / TOLERANCE:.2g}",
        f"{found['predicted_coverage']:.3f}",
        len(found["doubts"]),
        f"{found['seconds_total']:.0f}",
    ]
    return " | ".join(map(str, cells))


def _size(name: str, word: str) -> float:
    """A size of a sweep, in tolerances."""
    try:
        size = float(word)
    except ValueError:
        raise ValueError(f"got {word!r}; give {', '.join(SWEEPS)} or sizes in tolerances") from None
    # Half of the height is the largest radius; what is as thin as nothing is no wall, and no step.
    most = 0.5 * SIDES[2] / TOLERANCE if name == "rounding" else SIDES[2] / TOLERANCE
    if not (0.0 < size < most or (size == 0.0 and name == "rounding")):
        raise ValueError(f"got the size {word} for {name}; give one between 0 and {most:.0f}")
    return size


def main(*arguments: str) -> None:
    names = [name for name in arguments if name in SWEEPS] or list(SWEEPS)
    words = [word for word in arguments if word not in SWEEPS]
    sizes = {name: [_size(name, word) for word in words] or SWEEPS[name] for name in names}
    print(
        "| body, tolerances | touches | met | watertight | Euler (true) | faces | 95 % | largest |"
        " deviation there | predicted | doubts | seconds |"
    )
    print("|" + "---|" * 12)
    with TemporaryDirectory() as folder:
        for name in names:
            for size in sizes[name]:
                row = row_of(BODIES[name](size * TOLERANCE), Path(folder))
                print(f"| {name}, {size:g} | {row} |", flush=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
