"""The patches of an atlas beside overlapping quartics that are fitted to the same samples at once.

    python examples/patches_beside_quartics.py OBJECT ... [--seed S]

Each object, a name or the path of a mesh, is explored to its own tolerance. After every five
touches points of the true surface are compared with both: the mean, 95 % and 99.9 % of the
distances where the surface is known, in tolerances, the share of the whole surface within the
tolerance, and the share of errors within 1.96 predicted deviations, which is held. Quartics are
those of a free-form face: see touchatlas.atlas.faces.fit_free_form. Seconds of the processor are
those of all touches so far, and of the fit of all quartics.
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.atlas.faces.fit_free_form import fit_free_form
from touchatlas.atlas.faces.read_faces import samples_of
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import fit_scale

# Points of the true surface, and the radius of a quartic over the extent of the samples.
_POINTS, _RADIUS = 10_000, 0.15


def numbers(distance, deviation, known, tolerance: float) -> str:
    """Errors where the surface is known, in tolerances, and shares of all points."""
    off = np.abs(distance[known]) / tolerance
    tail = np.quantile(off, [0.95, 0.999])
    within, held = (
        (off < 1.0).sum() / len(known),
        (off * tolerance < 1.96 * deviation[known]).mean(),
    )
    return f"{off.mean():.3f} {tail[0]:.3f} {tail[1]:.2f}  within {within:.4f}  held {held:.3f}"


def compare(atlas: Atlas, truth, count: int, seconds: float) -> None:
    """Print a line of both."""
    samples = samples_of(atlas.membership.pool, atlas.point_count, atlas.sample_std)
    extent = float(np.linalg.norm(np.ptp(samples.points, axis=0)))
    start = time.process_time()
    found = fit_free_form(samples.points, samples.outward, samples.std, _RADIUS * extent)
    fitted = time.process_time() - start
    values, blend = found.values(truth), atlas.blend(truth)
    ours = numbers(blend.distance, blend.deviation, blend.known, atlas.tolerance)
    theirs = numbers(
        values[:, 0], np.sqrt(values[:, 4]), np.full(len(truth), True), atlas.tolerance
    )
    print(
        f"{count:3d} touches  {len(atlas):3d} patches {ours} {seconds:5.1f} s   "
        f"{len(found.pieces):3d} quartics {theirs} {fitted:.2f} s"
    )


def run(name: str, seed: int) -> None:
    """Explore one object, and print its lines."""
    obj = make_object(name)
    truth = obj.sample(_POINTS, np.random.default_rng(99))[0]
    atlas = Atlas(obj.tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    probe, seconds = Probe(obj, obj.noise_std, np.random.default_rng(seed)), 0.0
    print(f"{obj.name}, seed {seed}")
    start, count = time.process_time(), 0
    for count, _ in enumerate(explore(atlas, Planner(*obj.start()), probe), 1):
        seconds += time.process_time() - start
        if count % 5 == 0:
            compare(atlas, truth, count, seconds)
        start = time.process_time()
    compare(atlas, truth, count, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="+", metavar="OBJECT")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    for name in arguments.objects:
        run(name, arguments.seed)


if __name__ == "__main__":
    main()
