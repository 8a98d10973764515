"""What planning, learning and a whole touch cost, in bare solves of 57 x 15 (numpy.linalg.lstsq).

Learning is all that ``Atlas.add`` and ``Planner.tell`` do. Each cost is a median and the 99th
percentile over the touches. Objects, names or paths of meshes, are explored with seed 0. Numbers of
patches are an atlas of the wavy plain of cost_of_an_atlas.py that grows from its middle, whatever
is planned: each cost is that of the forty touches after it has so many.

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
    planner, seconds, solves = Planner(*obj.start()), [], []
    for step in explore(atlas, planner, Probe(obj, obj.noise_std, rng), most):
        seconds.append((step.seconds_plan, step.seconds_fit))
        solves.append(seconds_of_lstsq(MATRIX))
    show(obj.name, len(seconds), len(atlas), np.array(seconds) / np.median(solves))


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
    """(n, 2) costs of plans and of learning at the next touches, wherever these are."""
    planner, seconds, solves = Planner([0, 0, 1], [0, 0, 1]), [], []
    for _ in range(LAST):
        start = time.perf_counter()
        plan = planner.ask(atlas)
        asked = time.perf_counter()
        one = replace(touch(*next(touches), rng), number=plan.number)
        begun = time.perf_counter()
        planner.tell(one, atlas.add(one))
        seconds.append((asked - start, time.perf_counter() - begun))
        solves.append(seconds_of_lstsq(MATRIX))
    # The first plan computes all places.
    return np.array(seconds[1:]) / np.median(solves)


def show(name: str, touches: int, patches: int, costs) -> None:
    """Print one line of a table, from the costs (n, 2) of plans and of learning."""
    columns = [*costs.T, costs.sum(axis=1)]
    cells = [f"{np.median(column):.0f} / {np.quantile(column, 0.99):.0f}" for column in columns]
    print(f"| {name} | {touches} | {patches} | {' | '.join(cells)} |", flush=True)


def main(*names: str) -> None:
    print("| object | touches | patches | lstsq a plan, median / 99 % | learning | whole touch |")
    print("|---|---|---|---|---|---|")
    for name in names:
        if not name.isdigit():
            path, _, most = name.partition(":")
            of_object(path, int(most) if most else None)
    if sizes := [int(name) for name in names if name.isdigit()]:
        of_plain(sizes)


if __name__ == "__main__":
    words = sys.argv[1:] or ("bottle", "mouse", "torus", "blob", "100", "1000")
    sys.exit(exit_code(lambda: main(*words)))
