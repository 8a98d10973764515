"""What planning a touch costs, in bare least-squares solves of 57 x 15 (numpy.linalg.lstsq).

Objects, names or paths of meshes, are explored with seed 0. Numbers of patches are an atlas of the
wavy plain of cost_of_an_atlas.py that grows from its middle, whatever is planned: each is that of
the forty touches after it has so many.

    python examples/cost_of_planning.py [OBJECT[:TOUCHES] ...] [PATCHES ...]
"""

import os
import sys
import time
from dataclasses import replace
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from cost_of_an_atlas import SPACING, TOLERANCE, touch
from time_of_a_touch import seconds_of_lstsq

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.command.outcome import exit_code
from touchatlas.sim.folder.run_options import fit_scale

MATRIX = np.random.default_rng(0).normal(size=(57, 15))
LAST = 40


def of_object(name: str, most: int | None) -> None:
    """Explore an object, and print what its plans cost."""
    obj, rng = make_object(name), np.random.default_rng(0)
    atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner, plans, solves = Planner(*obj.start()), [], []
    for step in explore(atlas, planner, Probe(obj, obj.noise_std, rng), most):
        plans.append(step.seconds_plan)
        solves.append(seconds_of_lstsq(MATRIX))
    show(obj.name, len(plans), len(atlas), np.array(plans) / np.median(solves))


def of_plain(sizes: list[int]) -> None:
    """Grow an atlas of the plain, and print what plans cost from some sizes on."""
    rng, atlas = np.random.default_rng(0), Atlas(TOLERANCE)
    half = int(np.sqrt(max(sizes) + LAST * len(sizes)))
    side = np.arange(-half, half + 1)
    places = SPACING * np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    touches = enumerate(places[np.argsort((places**2).sum(axis=1), kind="stable")])
    for size in sorted(sizes):
        while len(atlas) < size:
            atlas.add(touch(*next(touches), rng))
        show("plain", atlas.touches, len(atlas), cost_of_some(atlas, touches, rng))


def cost_of_some(atlas: Atlas, touches, rng) -> np.ndarray:
    """What the plans between the next touches cost, wherever these are."""
    planner, plans, solves = Planner([0, 0, 1], [0, 0, 1]), [], []
    for _ in range(LAST):
        start = time.perf_counter()
        plan = planner.ask(atlas)
        plans.append(time.perf_counter() - start)
        solves.append(seconds_of_lstsq(MATRIX))
        one = replace(touch(*next(touches), rng), number=plan.number)
        planner.tell(one, atlas.add(one))
    # The first plan computes all places.
    return np.array(plans[1:]) / np.median(solves)


def show(name: str, touches: int, patches: int, cost) -> None:
    """Print one line of a table."""
    low, high = np.median(cost), np.quantile(cost, 0.99)
    print(f"| {name} | {touches} | {patches} | {low:.0f} | {high:.0f} |", flush=True)


def main(*names: str) -> None:
    print("| object | touches | patches | lstsq a plan, median | 99 % |\n|---|---|---|---|---|")
    for name in names:
        if not name.isdigit():
            path, _, most = name.partition(":")
            of_object(path, int(most) if most else None)
    if sizes := [int(name) for name in names if name.isdigit()]:
        of_plain(sizes)


if __name__ == "__main__":
    words = sys.argv[1:] or ("bottle", "mouse", "torus", "blob", "100", "1000")
    sys.exit(exit_code(lambda: main(*words)))
