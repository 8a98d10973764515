"""What planning, learning and a whole touch cost, in bare solves of 57 x 15 (numpy.linalg.lstsq).

Learning is all that ``Atlas.add`` and ``Planner.tell`` do. Each cost is a median and the 99th
percentile over the touches. Objects, names or paths of meshes, are explored with seed 0.

    python examples/cost_of_planning.py [OBJECT[:TOUCHES] ...]
"""

import os
import sys
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from time_of_a_touch import seconds_of_lstsq

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.command.outcome import exit_code
from touchatlas.sim.folder.run_options import fit_scale

MATRIX = np.random.default_rng(0).normal(size=(57, 15))


def of_object(name: str, most: int | None) -> None:
    """Explore an object, and print what its plans cost."""
    obj, rng = make_object(name), np.random.default_rng(0)
    atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner, seconds, solves = Planner(*obj.start()), [], []
    for step in explore(atlas, planner, Probe(obj, obj.noise_std, rng), most):
        seconds.append((step.seconds_plan, step.seconds_fit))
        solves.append(seconds_of_lstsq(MATRIX))
    show(obj.name, len(seconds), len(atlas), np.array(seconds) / np.median(solves))


def show(name: str, touches: int, patches: int, costs) -> None:
    """Print one line of a table, from the costs (n, 2) of plans and of learning."""
    columns = [*costs.T, costs.sum(axis=1)]
    cells = [f"{np.median(column):.0f} / {np.quantile(column, 0.99):.0f}" for column in columns]
    print(f"| {name} | {touches} | {patches} | {' | '.join(cells)} |", flush=True)


def main(*names: str) -> None:
    print("| object | touches | patches | lstsq a plan, median / 99 % | learning | whole touch |")
    print("|---|---|---|---|---|---|")
    for name in names:
        path, _, most = name.partition(":")
        of_object(path, int(most) if most else None)


if __name__ == "__main__":
    words = sys.argv[1:] or ("bottle", "mouse", "torus", "blob")
    sys.exit(exit_code(lambda: main(*words)))
