"""How long a touch takes, and how long all touches take to become a surface, beside others.

    python examples/speed.py [OBJECT[:TOUCHES] ...] [--places N] [--cells N]

The first table is of an exploration with seed 0, up to so many touches: milliseconds to plan a
touch, to learn it, and for both, the median and the 99th percentile; the median of the last quarter
of the touches over that of the first; and seconds in all with the finish and the surface, without
the simulator. The second is of touches at places spread evenly: seconds to learn them one by one,
or their curves as one Scan, and to draw the surface, with as many cubes along the longest side as
the others have cells; and the mean distance of the true surface from it, in 1e-4 of the diagonal.
Others get our normals and have the best of three settings. Seconds are of one processor.
"""

import argparse
import os
import sys
import time

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import numpy as np

from touchatlas.atlas import Atlas, Scan, extract_surface
from touchatlas.planner import Planner
from touchatlas.sim import Probe, make_object
from touchatlas.sim.command.outcome import exit_code
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.study.surface_peers import PEERS, best_surface, samples_of, spread_plans
from touchatlas.sim.study.tradeoff import timed

TRUTH = 4000


class Clock:
    """Processor seconds between calls."""

    def __init__(self) -> None:
        self.last = time.process_time()

    def lap(self) -> float:
        before, self.last = self.last, time.process_time()
        return self.last - before


def explored(name: str, most: float) -> str:
    """The row of an exploration."""
    obj, rng = make_object(name), np.random.default_rng(0)
    atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner, probe = Planner(*obj.start()), Probe(obj, obj.noise_std, rng)
    clock, laps = Clock(), []
    while len(laps) < most and (plan := planner.ask(atlas)) is not None:
        planned, touch = clock.lap(), probe(plan)
        clock.lap()
        planner.tell(touch, atlas.add(touch))
        laps.append((planned, clock.lap()))
    rest = clock.lap()
    atlas.finish()
    extract_surface(atlas)
    rest += clock.lap()
    plans, learning = 1e3 * np.array(laps).T
    both = plans + learning
    cells = [f"{np.median(x):.0f} / {np.quantile(x, 0.99):.0f}" for x in (plans, learning, both)]
    quarter = -(-len(both) // 4)
    growth = np.median(both[-quarter:]) / np.median(both[:quarter])
    total = rest + 1e-3 * both.sum()
    return row(obj.name, len(laps), len(atlas), *cells, f"{growth:.1f}", f"{total:.1f}")


def at_once(name: str, places: int, cells: int) -> str:
    """The row of all touches at evenly spread places."""
    obj, rng = make_object(name), np.random.default_rng(0)
    probe = Probe(obj, obj.noise_std, rng)
    truth = obj.sample(TRUTH, rng)[0]
    touches = [probe(plan) for plan in spread_plans(*obj.sample(TRUTH, rng), places)]
    edge, scan = float(np.ptp(truth, axis=0).max()) / cells, scan_of(touches)

    def learned(call):
        way, measured = call
        atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
        way(atlas, measured)
        return atlas, extract_surface(atlas, edge)

    def shown(vertices, faces, seconds: float) -> str:
        error = ClosestPoints(vertices, faces)(truth)[0].mean() / obj.diagonal
        return f"{seconds:.2f} ({1e4 * error:.2f})"

    out = []
    for call in ((add_each, touches), (Atlas.add_all, touches), (Atlas.add, scan)):
        (atlas, ours), seconds = timed(learned, call)
        out.append(shown(ours.vertices, ours.faces, seconds))
    points, normals = samples_of(atlas, touches)
    for peer in PEERS.values():
        data = points, normals, obj.noise_std, cells, truth
        found = best_surface(peer, *data) if peer.present() else None
        out.append("–" if found is None else shown(*found[0], found[2]))
    return row(obj.name, places, len(points), len(ours.vertices), *out)


def add_each(atlas: Atlas, touches) -> None:
    """Learn touches one after the other."""
    for touch in touches:
        atlas.add(touch)


def scan_of(touches) -> Scan:
    """The curves of touches as one scan."""
    curves = [(contour, touch.approach) for touch in touches for contour in touch.contours]
    counts = [len(contour.points) for contour, _ in curves]
    return Scan(
        np.concatenate([contour.points for contour, _ in curves]),
        np.repeat([contour.noise_std for contour, _ in curves], counts),
        approach=np.repeat([approach for _, approach in curves], counts, axis=0),
        curves=np.repeat(np.arange(len(curves)), counts),
    )


def row(*cells) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def print_table(head: tuple[str, ...], rows) -> None:
    print(row(*head), "|---" * len(head) + "|", sep="\n")
    for one in rows:
        print(one, flush=True)


def main(arguments: argparse.Namespace) -> None:
    bodies = [word.partition(":")[::2] for word in arguments.objects]
    figures = "plan, ms, median / 99 %", "learn", "both", "last / first quarter", "all, s"
    rows = (explored(name, float(most or np.inf)) for name, most in bodies)
    print_table(("object", "touches", "patches", *figures), rows)
    print()
    figures = (
        "places",
        "points",
        "vertices",
        "touch by touch, s (error)",
        "all at once",
        "one scan",
        *PEERS,
    )
    rows = (at_once(name, arguments.places, arguments.cells) for name, _ in bodies)
    print_table(("object", *figures), rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    known = ["bottle", "mouse", "torus", "blob", "plate"]
    parser.add_argument("objects", nargs="*", default=known, metavar="OBJECT[:TOUCHES]")
    parser.add_argument("--places", type=int, default=40)
    parser.add_argument("--cells", type=int, default=64)
    given = parser.parse_args()
    sys.exit(exit_code(lambda: main(given)))
