"""What one more touch, a patch and a thousand queries cost, as an atlas of a wavy plain grows.

Touches are made directly from z = a sin x sin y, so that only the library's own time is seen:
processor time, medians, as ratios to the smallest atlas. Memory is traced in a run of its own.

    python examples/cost_of_an_atlas.py [PATCHES ...]
"""

import os
import sys
import time
import tracemalloc
from collections import Counter
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.touch import Touch, TouchStatus
from touchatlas.patch.contour import Contour, ContourEnd
from touchatlas.planner.planes import concurrent_planes

HEIGHT, REACH, SPACING, TOLERANCE, NOISE = 0.2, 0.6, 0.62, 5e-3, 1e-3
ALONG = np.linspace(-REACH, REACH, 19)
LAST, QUERIES, TRACED = 40, 1000, 1000


def height(x, y):
    return HEIGHT * np.sin(x) * np.sin(y)


def touch(number: int, xy, rng) -> Touch:
    """Three contours through the surface point over xy, in planes that hold its normal."""
    (x, y), e = xy, 1e-6
    slope = np.array([height(x + e, y) - height(x - e, y), height(x, y + e) - height(x, y - e)])
    contact, normal = np.array([x, y, height(x, y)]), np.append(-slope / (2 * e), 1.0)
    normal /= np.linalg.norm(normal)
    contours = []
    for plane in concurrent_planes(contact, normal, [np.cos(number), np.sin(number), 0.0], 3):
        points = contact + ALONG[:, None] * np.cross(plane.normal, normal)
        for _ in range(6):
            points += (height(points[:, 0], points[:, 1]) - points[:, 2])[:, None] * normal
        points += NOISE * rng.normal(size=points.shape)
        contours.append(Contour(points, plane, NOISE, (ContourEnd.LENGTH_REACHED,) * 2))
    return Touch(number, contact, normal, tuple(contours), TouchStatus.TOUCHED, 6 * REACH, 0.0)


def places(count: int, rng):
    """(n, 2) places from the middle outward, as far apart as patches are in an exploration."""
    side = np.arange(-int(np.sqrt(count)), int(np.sqrt(count)) + 1)
    xy = SPACING * np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    xy = xy + 0.1 * SPACING * rng.uniform(-1.0, 1.0, xy.shape)
    return xy[np.argsort((xy**2).sum(axis=1))]


def seconds(call) -> float:
    start = time.process_time()
    call()
    return time.process_time() - start


def seconds_of_queries(atlas: Atlas, rng) -> float:
    """Of a blend at points about all patches; the median of some."""
    at = atlas.table.origin[rng.integers(len(atlas), size=QUERIES)]
    at = at + 0.5 * REACH * rng.uniform(-1.0, 1.0, (QUERIES, 3)) * [1.0, 1.0, 0.0]
    at[:, 2] = height(at[:, 0], at[:, 1]) + 0.05 * rng.normal(size=QUERIES)
    return float(np.median([seconds(lambda: atlas.blend(at)) for _ in range(15)]))


def grow(sizes) -> tuple[Atlas, list]:
    """An atlas of the largest size; patches, seconds a touch and of queries at every size."""
    rng, atlas, updates, costs = np.random.default_rng(0), Atlas(TOLERANCE), [], []
    for xy in places(max(sizes), rng):
        one = touch(len(updates), xy, rng)
        updates.append(seconds(lambda one=one: atlas.add(one)))
        if len(atlas) in sizes[len(costs) :]:
            median = float(np.median(updates[-LAST:]))
            costs.append((len(atlas), median, seconds_of_queries(atlas, rng)))
        if len(atlas) == max(sizes):
            break
    return atlas, costs


def main(*sizes: int) -> None:
    costs = grow(sizes)[1]
    print("| patches | ms a touch | ratio | ms 1,000 queries | ratio |\n|---|---|---|---|---|")
    for n, t, q in costs:
        ratios = t / costs[0][1], q / costs[0][2]
        print(f"| {n} | {1e3 * t:.2f} | {ratios[0]:.2f} | {1e3 * q:.1f} | {ratios[1]:.2f} |")
    tracemalloc.start()
    atlas, where = grow([min(TRACED, max(sizes))])[0], Counter()
    for entry in tracemalloc.take_snapshot().statistics("filename"):
        where[Path(entry.traceback[0].filename).stem] += entry.size / len(atlas)
    samples = 3 * atlas.learning.pool.points.nbytes / len(atlas)
    print(f"bytes a patch: {sum(where.values()):.0f}, of them samples {samples:.0f}; by file:")
    print(", ".join(f"{name} {size:.0f}" for name, size in where.most_common(7)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or ("100", "1000", "10000")))
