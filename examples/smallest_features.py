"""Holes, horns and fingers that an exploration misses, without and with `--feature`.

    python examples/smallest_features.py [BODY ...] [--feature F ...] [--seeds N]

Bodies are those of the guard and a skull, read from the folder TOUCHATLAS_OBJECTS. Features are
fractions of the diagonal; 0 asks for none. The table has touches, whether the tolerance is met, the
share of the true surface within it, the part of it that is farther than a feature's radius from
the surface (a horn or finger that is missed), Euler characteristics (a hole that is missed), and
the largest disc without a sample as it is said beside that of the true mesh, in diagonals.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import guard_bodies

from touchatlas.atlas import extract_surface
from touchatlas.atlas.check.free_disc import largest_free_disc
from touchatlas.planner import PlannerOptions, explore
from touchatlas.sim import Probe, RunOptions
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.surface_judge import judged

SMALL = 0.08
FIGURES = (
    *("body", "feature", "seed", "touches", "met", "within", "predicted", "missed"),
    *("euler", "true_euler", "disc", "true_disc", "ended", "processor"),
)


def bodies() -> dict[str, guard_bodies.Body]:
    """The bodies of the guard, and a skull with two arches."""
    return guard_bodies.bodies() | {"skull": guard_bodies.scan("scan", "skull_ode", tolerance=1e-2)}


def explored(name: str, feature: float, seed: int, most: int) -> str:
    """The line of the table for one exploration."""
    body = bodies()[name]
    obj = body.make()
    tolerance = body.tolerance_of(obj)
    wanted = PlannerOptions(feature=feature * obj.diagonal)
    options = RunOptions(obj.noise_std, tolerance, seed=seed, planner=wanted)
    probe_rng, _, _, planner_rng = random_streams(seed)
    begun = time.process_time()
    atlas, planner = begin(options, obj, planner_rng)
    touches = sum(1 for _ in explore(atlas, planner, Probe(obj, obj.noise_std, probe_rng), most))
    atlas.finish()
    surface = extract_surface(atlas)
    seconds = time.process_time() - begun
    points = obj.sample(8000, np.random.default_rng(99))[0]
    mesh = surface.vertices, surface.faces
    verdict = judged(mesh, obj, points, tolerance)
    off = np.sqrt(igl.point_mesh_squared_distance(points, *mesh)[0])
    vertices, faces = obj.mesh(0.1 * tolerance)
    true = largest_free_disc(vertices[faces], atlas.pool.points, atlas.pool.normals)
    said = planner.free_disc(atlas)
    numbers = [
        *(name, f"{feature:g}", seed, touches, int(verdict["met"])),
        f"{verdict['known_share']:.4f}",
        f"{planner.forecast(atlas).predicted_coverage:.4f}",
        f"{np.mean(off > 0.5 * (feature or SMALL) * obj.diagonal):.4f}",
        int(igl.euler_characteristic(surface.faces)),
        obj.euler_characteristic,
        *(f"{disc.diameter / obj.diagonal:.3f}" for disc in (said, true)),
        *("budget" if planner.stop is None else planner.stop.reason.value, f"{seconds:.0f}"),
    ]
    return "| " + " | ".join(map(str, numbers)) + " |"


def main(arguments: argparse.Namespace) -> None:
    print("| " + " | ".join(FIGURES) + " |\n" + "|---" * len(FIGURES) + "|", flush=True)
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    cells = [*product(arguments.bodies, arguments.feature, seeds)]
    with ProcessPoolExecutor(arguments.workers) as pool:
        rest = zip(*cells, strict=True)
        for line in pool.map(explored, *rest, [arguments.most] * len(cells)):
            print(line, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bodies", nargs="*", default=["bracket", "spot", "hand"], metavar="BODY")
    parser.add_argument("--feature", nargs="+", type=float, default=[0.0, SMALL])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--most", type=int, default=200, help="touches")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    guard_bodies.check_names(parser, arguments.bodies, bodies())
    main(arguments)
