"""Steps that become low: what is found, and at what cost.

    python examples/low_steps.py [HEIGHT ...]

One half of a box of 60 x 40 x 30 mm is lower by each HEIGHT, in tolerances. Every body is explored
until its planner stops, or for 120 touches. Blunt edges and thin walls are families of
`touchatlas chart --stability`: atlas_edge and atlas_slab.
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
HEIGHTS = ("0.5", "1", "2", "5", "20", "50")


def step(height: float) -> trimesh.Trimesh:
    """A box one half of which is higher."""
    x, z = SIDES[0], SIDES[2]
    profile = np.array([[0, 0], [x / 2, 0], [x, 0], [x, z], [x / 2, z], [x / 2, z - height]])
    profile = np.vstack([profile, [0, z - height]])
    triangles = np.array([[0, 1, 5], [0, 5, 6], [1, 2, 3], [1, 3, 5], [5, 3, 4]])
    return trimesh.creation.extrude_triangulation(profile, triangles, height=SIDES[1])


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


def main(*heights: str) -> None:
    print(
        "| height, tolerances | touches | met | watertight | Euler (true) | faces | 95 % | "
        "largest | deviation there | predicted | doubts | seconds |"
    )
    print("|" + "---|" * 12)
    with TemporaryDirectory() as folder:
        for word in heights or HEIGHTS:
            if not word.replace(".", "", 1).isdecimal() or not 0.0 < float(word) < 30.0 / TOLERANCE:
                raise ValueError(f"got {word!r}; give heights above 0 and below 30 mm")
            print(f"| {word} | {row_of(step(float(word) * TOLERANCE), Path(folder))} |", flush=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
