"""Whole surfaces from the same touches: ours against others', with three kinds of normals.

Errors in 1e-4 of the diagonal, truth to surface where not said; of others the best of three
settings.

    python examples/surface_peers.py [OBJECT [TOUCHES [NOISE [CELLS [METHODS]]]]]

OBJECT is built in (blob:2 has seed 2), a mesh file, or a mesh in the folder TOUCHATLAS_OBJECTS;
TOUCHES how many places, spread evenly, or "explore" (a mesh: 400 at most); NOISE a fraction of the
diagonal; CELLS those of the others' grids along the longest side; METHODS names, or "all".
"""

import os
import sys
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import numpy as np

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, evaluate_surface, make_object, object_names, truth_of
from touchatlas.sim.study import surface_peers as others
from touchatlas.sim.study.tradeoff import timed

FOLDER = os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
# Our surface is asked for with this fraction of the object's tolerance, so that neither triangles
# nor patches are coarser than the touches tell. At 1 triangles alone err by up to the noise.
FINER = 0.1
HEAD = "| method | normals | mean | rms | p99 | surface to truth | covered | setting | seconds |"


def find(name: str):
    """The object of the first argument."""
    name, _, seed = name.partition(":")
    known = name in object_names() or Path(name).is_file()
    return make_object(name if known else f"{Path(FOLDER, name)}.ply", int(seed or 0))


def touch(obj, count: str, noise_std: float, rng) -> list:
    """Touches of an exploration, or at places spread evenly."""
    probe = Probe(obj, noise_std, rng)
    if count == "explore":
        most = None if obj.name in object_names() else 400
        steps = explore(Atlas(obj.tolerance), Planner(*obj.start()), probe, most)
        return [step.touch for step in steps]
    return [probe(plan) for plan in others.spread_plans(*obj.sample(4000, rng), int(count))]


def learn(touches, tolerance: float):
    """Our atlas of the touches, and its surface."""
    atlas = Atlas(FINER * tolerance)
    for one in touches:
        atlas.add(one)
    atlas.finish()
    return atlas, extract_surface(atlas)


def show(method, normals, surface, setting, seconds, truth, obj) -> None:
    e = evaluate_surface(*surface, truth, obj.tolerance, np.random.default_rng(0))
    p99 = np.quantile(others.distances(*surface, truth.points), 0.99)
    lengths = (e.completeness_mean, e.completeness_rms, p99, e.accuracy_mean)
    figures = " | ".join(f"{1e4 * length / obj.diagonal:.3g}" for length in lengths)
    tail = f"{e.coverage:.3f} | {setting} | {seconds:.2f}"
    print(f"| {method} | {normals} | {figures} | {tail} |", flush=True)


def main(name="ellipsoid_paper", count="16", noise="2e-4", cells="32", methods="APSS") -> None:
    peers = others.PEERS if methods == "all" else {m: others.PEERS[m] for m in methods.split(",")}
    absent = [method for method in peers if not peers[method].present()]
    print(f"Left out, since what they import is absent: {', '.join(absent) or 'none'}.")
    obj, rng = find(name), np.random.default_rng(0)
    noise_std, truth = float(noise) * obj.diagonal, truth_of(obj, obj.tolerance, rng)
    touches = touch(obj, count, noise_std, rng)
    (atlas, ours), seconds = timed(lambda some: learn(some, obj.tolerance), touches)
    points, normals = others.points_and_normals(obj, atlas, touches)
    print(f"\n{name}, {count} touches, noise {noise}: {len(atlas)} patches, {len(points)} points")
    print(HEAD + "\n" + "|---" * (HEAD.count("|") - 1) + "|")
    show("touchatlas", "own", (ours.vertices, ours.faces), "", seconds, truth, obj)
    for kind, (directions, before) in normals.items():
        for method in peers.keys() - absent:
            data = (points, directions, noise_std, int(cells), truth.points[:4000])
            if found := others.best_surface(peers[method], *data):
                show(method, kind, found[0], found[1], before + found[2], truth, obj)


if __name__ == "__main__":
    main(*sys.argv[1:])
