"""Touches that a tolerance takes: `economy.py OBJECT[:TOLERANCE] ... [--seeds N]`.

Each object, a name or the path of a mesh, is explored to its own tolerance or the given one, in
the file's unit. A line tells touches, lengths, the share of the true surface within the
tolerance beside the predicted one, and whether the surface meets the tolerance (see ``judged``).
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time

import numpy as np
import trimesh

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.study.economy import judged

# Points at which the surface is compared with the truth: the standard error of a share of 0.99
# is 0.001. Four times as many halve it.
_POINTS = 8000


def run(name: str, tolerance: float | None, seed: int) -> None:
    """Explore one object, and print its line."""
    obj = make_object(name)
    tolerance = obj.tolerance if tolerance is None else tolerance
    atlas = Atlas(tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner = Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(seed))
    start = time.process_time()
    touches = [step.touch for step in explore(atlas, planner, probe)]
    atlas.finish()
    seconds = time.process_time() - start
    surface = extract_surface(atlas)
    truth = obj.sample(_POINTS, np.random.default_rng(99))[0]
    found = judged((surface.vertices, surface.faces), obj, truth, tolerance)
    euler = trimesh.Trimesh(surface.vertices, surface.faces, process=False).euler_number
    stop = planner.stop
    ended = stop.reason.value if stop else ""
    predicted = f"{stop.forecast.predicted_coverage:.4f}" if stop else "-"
    print(
        f"{obj.name:14} tolerance {tolerance:<8.4g} seed {seed}  touches {len(touches):4d}  "
        f"tracked {sum(t.tracked_length for t in touches):9.5g}  "
        f"travel {sum(t.travel_length for t in touches):9.5g}  patches {len(atlas):4d}  "
        f"within {found['known_share']:.4f} predicted {predicted}  "
        f"95 % {found['p95_error'] / tolerance:.3f}  Euler {euler} ({obj.euler_characteristic})  "
        f"{'met' if found['met'] else 'NOT MET'}  {seconds:.1f} s  {ended}",
        flush=True,
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="+", metavar="OBJECT[:TOLERANCE]")
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    for each in arguments.objects:
        name, _, tolerance = each.partition(":")
        for seed in range(arguments.seeds):
            run(name, float(tolerance) if tolerance else None, seed)
