"""The library's own time a touch, as a multiple of one bare least-squares solve.

Fit, update, boundaries and planning, without simulator and surface; the solve is
numpy.linalg.lstsq of a 57 x 15 matrix (the paper's 57 points, a quartic's 15 coefficients),
timed between the touches of the same run.

    python examples/time_of_a_touch.py [OBJECT [TOUCHES]]
"""

import argparse
import time

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import fit_scale

WINDOW = 15


def seconds_of_lstsq(matrix) -> float:
    """One bare solve, the best of three so that the caches are warm."""
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        np.linalg.lstsq(matrix, matrix[:, 0], rcond=None)
        best = min(best, time.perf_counter() - start)
    return best


def main(name: str, most: int | None) -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(57, 15))
    obj = make_object(name)
    atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner = Planner(*obj.start())
    touches, plans, solves = [], [], []
    for step in explore(atlas, planner, Probe(obj, obj.noise_std, rng), most):
        touches.append(step.seconds_plan + step.seconds_fit)
        plans.append(step.seconds_plan)
        solves.append(seconds_of_lstsq(matrix))
    solve = np.median(solves)
    print(f"{obj.name}: {len(touches)} touches, {len(atlas)} patches")
    print(f"one lstsq of 57 x 15: {1e6 * solve:.1f} us")
    print(
        f"a touch: median {1e3 * np.median(touches):.2f} ms, {np.median(touches) / solve:.1f} lstsq"
    )
    print(f"all: {sum(touches):.1f} s, planning {sum(plans):.1f} s; longest: {max(touches):.1f} s")
    if len(touches) >= 200:
        early = np.median(touches[20 - WINDOW : 20 + WINDOW])
        late = np.median(touches[200 - WINDOW : 200 + WINDOW])
        print(f"200th over 20th touch (medians of {2 * WINDOW}): {late / early:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("object", nargs="?", default="torus", help="a name, or the path of a mesh")
    parser.add_argument("touches", nargs="?", type=int, help="the most that are made")
    given = parser.parse_args()
    if given.touches is not None and given.touches < 1:
        parser.error(f"touches are {given.touches}; they must be 1 or more")
    main(given.object, given.touches)
