"""What an atlas says of its errors while little is known.

    python examples/sparse_states.py OBJECT ... [--seeds N]

Each object, a name or the path of a mesh, is explored to its own tolerance. After a quarter, a half
and all of the touches, points of the true surface where the atlas knows it are compared with it: a
line tells the known share, Spearman's rank correlation of predicted deviation and error, and the
share of the errors within 1.96 deviations. The last line of an exploration adds its tracked length
over A / (2 rho), the least length of a track that passes all of an area A within rho. rho is what
95 % of the surface is within.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import spearmanr

from touchatlas.atlas import Atlas
from touchatlas.atlas.field.predicted_deviation import predicted_deviation
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import fit_scale

# Points of the true surface: the standard error of a share of 0.95 is 0.005.
_POINTS = 2000


def numbers(atlas: Atlas, truth) -> str:
    """Known share, rank correlation, and share within 1.96 deviations, of points (n, 3)."""
    found = atlas.blend(truth)
    error, known = np.abs(found.distance), found.known
    deviation = predicted_deviation(atlas.table, found)
    # The truth has no noise. What fits leave out counts as if it were some.
    held = error[known] <= 1.96 * np.hypot(deviation[known], atlas.bias)
    rank = spearmanr(deviation[known], error[known]).statistic
    return f"known {known.mean():.3f}  rank correlation {rank:.2f}  held {held.mean():.3f}"


def run(name: str, seed: int) -> None:
    """Explore one object, and print its lines."""
    obj = make_object(name)
    truth = obj.sample(_POINTS, np.random.default_rng(99))[0]

    def explored(most: int | None) -> tuple[Atlas, list]:
        atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
        probe = Probe(obj, obj.noise_std, np.random.default_rng(seed))
        steps = explore(atlas, Planner(*obj.start()), probe, most)
        return atlas, [step.touch for step in steps]

    whole, touches = explored(None)
    for count in (len(touches) // 4, len(touches) // 2):
        if count:
            found = numbers(explored(count)[0], truth)
            print(f"{obj.name:12} seed {seed}  {count:4d} touches  {found}")
    contacts = np.concatenate([c.points for touch in touches for c in touch.contours])
    rho = np.quantile(cKDTree(contacts).query(truth)[0], 0.95)
    length = sum(touch.tracked_length for touch in touches) / (0.5 * obj.area / rho)
    last = f"{len(touches):4d} touches  {numbers(whole, truth)}  length / bound {length:.2f}"
    print(f"{obj.name:12} seed {seed}  {last}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="+", metavar="OBJECT")
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    for each in arguments.objects:
        for number in range(arguments.seeds):
            run(each, number)
