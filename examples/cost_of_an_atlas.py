"""What one more touch, a patch and a thousand queries cost, as an atlas of a wavy plain grows.

Touches are made directly from z = a sin x sin y: only the library's own processor time is seen,
as ratios to the smallest atlas. Memory is traced in a run of its own.

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

from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd
from touchatlas.planner.planes import concurrent_planes

HEIGHT, REACH, SPACING, TOLERANCE, NOISE = 0.2, 0.6, 0.62, 5e-3, 1e-3
ALONG = np.linspace(-REACH, REACH, 19)


def height(x, y):
    return HEIGHT * np.sin(x) * np.sin(y)


def touch(number: int, xy, rng) -> Touch:
    """Three contours through the surface point over xy, in planes that hold its normal."""
    (x, y), e = xy, 1e-6
    slope = np.array([height(x + e, y) - height(x - e, y), height(x, y + e) - height(x, y - e)])
    contact, normal = np.array([x, y, height(x, y)]), np.append(-slope / (2 * e), 1.0)
    normal, contours = normal / np.linalg.norm(normal), []
    for plane in concurrent_planes(contact, normal, [np.cos(number), np.sin(number), 0.0], 3):
        points = contact + ALONG[:, None] * np.cross(plane.normal, normal)
        for _ in range(6):
            points += (height(points[:, 0], points[:, 1]) - points[:, 2])[:, None] * normal
        points = points + NOISE * rng.normal(size=points.shape)
        contours.append(Contour(points, plane, NOISE, (ContourEnd.LENGTH_REACHED,) * 2))
    return Touch(number, contact, normal, tuple(contours), TouchStatus.TOUCHED, 6 * REACH, 0.0)


def seconds(call, repeats: int = 1) -> float:
    times = [time.process_time()]
    for _ in range(repeats):
        call()
        times.append(time.process_time())
    return float(np.median(np.diff(times)))


def grow(sizes):
    """An atlas of the largest size; patches, ms a touch and ms of queries at every size."""
    # Once a large array was given back, the allocator keeps what smaller ones give back: else
    # the smallest atlas alone would pay for fresh pages, and the ratios would flatter.
    np.ones(3 << 20)
    rng, atlas, updates, costs = np.random.default_rng(0), Atlas(TOLERANCE), [], []
    side = np.arange(-int(np.sqrt(max(sizes))), int(np.sqrt(max(sizes))) + 1)
    places = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    places = SPACING * (places + 0.1 * rng.uniform(-1.0, 1.0, places.shape))
    for xy in places[np.argsort((places**2).sum(axis=1))]:
        one = touch(len(updates), xy, rng)
        updates.append(1e3 * seconds(lambda one=one: atlas.add(one)))
        if len(atlas) in sizes[len(costs) :]:
            at = atlas.table.origin[rng.integers(len(atlas), size=1000)]
            at = at + 0.5 * REACH * rng.uniform(-1.0, 1.0, (1000, 3))
            at[:, 2] = height(*at[:, :2].T) + 0.05 * rng.normal(size=1000)
            queries = 1e3 * seconds(lambda at=at: atlas.blend(at), 15)
            costs.append((len(atlas), float(np.median(updates[-40:])), queries))
        if len(costs) == len(sizes):
            break
    return atlas, costs


def main(*sizes: int) -> None:
    print("| patches | ms a touch | ratio | ms 1,000 queries | ratio |\n|---|---|---|---|---|")
    for n, t, q in (costs := grow(sizes)[1]):
        print(f"| {n} | {t:.2f} | {t / costs[0][1]:.2f} | {q:.1f} | {q / costs[0][2]:.2f} |")
    tracemalloc.start()
    (atlas, _), where = grow([min(1000, max(sizes))]), Counter()
    snapshot = tracemalloc.take_snapshot()
    tracemalloc.stop()
    for entry in snapshot.statistics("filename"):
        where[Path(entry.traceback[0].filename).stem] += entry.size // len(atlas)
    pool, membership = atlas.membership.pool, atlas.membership
    own = (pool.points, pool.normals, pool.across, pool.edges)
    samples = sum(column.nbytes for column in own) // len(atlas)
    lists = sum(i.nbytes for part in (membership.fitted, membership.owned) for i in part)
    rest, lists = sum(where.values()) - samples, lists // len(atlas)
    print(f"bytes a patch: {rest + samples}; {where.most_common(7)}")
    print(f"samples (points, normals, planes, edges): {samples}; besides them: {rest}")
    print(f"of that, numbers of the samples that a patch fitted or owned: {lists}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or ("100", "1000", "10000")))
