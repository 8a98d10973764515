"""The guard: explores one body of each kind, and marks what is worse than the kept figures.

    python examples/guard.py [--quick | --full] [--only NAME ...] [--renew] [--kept CSV]

Each body is explored with three seeds, the long ones with one (three with --full); --quick is two
minutes. The table has the figures of today beside those of docs/guard.csv. A mark names what is
worse than its bound, and the exit code is 1 where there is one: a body that was met is met; sums
of touches and of processor seconds are not larger; of a body the mean 95 % error is at most 1.1
times, the largest error at most 1.5 times the kept one. --renew writes today's rows over the kept
ones. Scans are read from the folder TOUCHATLAS_OBJECTS and are left out where it is missing.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import hashlib
import resource
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from guard_bodies import OBJECTS, bodies

from touchatlas.atlas import extract_surface
from touchatlas.planner import explore
from touchatlas.sim import Probe, RunOptions
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.run.conclusion import truth_of
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.surface_judge import judged

KEPT = Path(__file__).parents[1] / "docs" / "guard.csv"
KEY = ("body", "seed")
FIGURES = (
    *("touches", "length", "met", "within", "predicted", "p95", "largest", "calibration"),
    *("euler", "true_euler", "manifold", "faces", "patches", "seconds", "megabytes", "bytes"),
)
COLUMNS = (*KEY, "kind", *FIGURES)


QUICK = ("bottle", "cube", "torus", "plate", "holed ball")


def is_manifold(faces) -> bool:
    """Whether no triangle names a vertex twice, no edge has three triangles, and the triangles
    at each vertex are one fan."""
    a, b, c = faces.T
    distinct = not ((a == b) | (b == c) | (c == a)).any()
    one_fan = np.asarray(igl.is_vertex_manifold(faces)[0] if distinct else False).all()
    return bool(distinct and one_fan and igl.is_edge_manifold(faces)[0])


def explored(name: str, seed: int) -> dict[str, str]:
    """The row of one exploration, as text. Lengths are in tolerances but ``length``, which is in
    diagonals."""
    body = bodies()[name]
    obj = body.make()
    tolerance = body.tolerance_of(obj)
    probe_rng, judge_rng, _, planner_rng = random_streams(seed)
    atlas, planner = begin(RunOptions(obj.noise_std, tolerance, seed=seed), obj, planner_rng)
    probe, touches, probing = Probe(obj, obj.noise_std, probe_rng), [], 0.0

    def touch(plan):
        nonlocal probing
        begun = time.process_time()
        found = probe(plan)
        probing += time.process_time() - begun
        return found

    begun = time.process_time()
    touches = [step.touch for step in explore(atlas, planner, touch, body.most)]
    predicted = planner.forecast(atlas).predicted_coverage
    atlas.finish()
    surface = extract_surface(atlas)
    seconds = time.process_time() - begun - probing
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    mesh = surface.vertices, surface.faces
    truth = truth_of(obj, tolerance, judge_rng)
    deviation = surface.deviation
    found = evaluate_surface(*mesh, truth, tolerance, judge_rng, deviation)
    points = obj.sample(8000, np.random.default_rng(99))[0]
    verdict = judged(mesh, obj, points, tolerance)
    content = b"".join(np.ascontiguousarray(part).tobytes() for part in mesh)
    length = sum(one.tracked_length + one.travel_length for one in touches)
    numbers = {
        "touches": len(touches),
        "length": length / obj.diagonal,
        "met": int(verdict["met"]),
        "within": verdict["known_share"],
        "predicted": predicted,
        "p95": max(found.accuracy_p95, found.completeness_p95) / tolerance,
        "largest": max(found.accuracy_max, found.completeness_max) / tolerance,
        "calibration": found.deviation_calibration,
        "euler": found.euler_characteristic,
        "true_euler": obj.euler_characteristic,
        "manifold": int(is_manifold(surface.faces)),
        "faces": 0 if atlas.body is None else len(atlas.body.faces),
        "patches": len(atlas),
        "seconds": seconds,
        "megabytes": kilobytes / 1024,
    }
    row = {"body": name, "seed": str(seed), "kind": body.kind}
    row |= {key: _text(value) for key, value in numbers.items()}
    return row | {"bytes": hashlib.sha256(content).hexdigest()[:12]}


def _text(value) -> str:
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def failed(name: str, seed: int, error: Exception) -> dict[str, str]:
    """The row of an exploration that an error has ended."""
    row = dict.fromkeys(COLUMNS, "nan")
    words = f"{type(error).__name__}: {error}".splitlines()[0]
    return row | {"body": name, "seed": str(seed), "kind": bodies()[name].kind, "bytes": words}


def rows_of(cells: list[tuple[str, int]], workers: int) -> Iterable[dict[str, str]]:
    """The rows of bodies and seeds, each as soon as it is there, each in a process of its own so
    that its peak memory is its own."""
    with ProcessPoolExecutor(workers, get_context("spawn"), max_tasks_per_child=1) as pool:
        waiting = {pool.submit(explored, *cell): cell for cell in cells}
        for future in as_completed(waiting):
            try:
                yield future.result()
            except Exception as error:  # noqa: BLE001 - a body that fails is a row of the table.
                yield failed(*waiting[future], error)


def read_kept(path: Path) -> dict[tuple[str, ...], dict[str, str]]:
    """The kept rows by body and seed."""
    if not path.exists():
        return {}
    with open(path, newline="", encoding="utf-8") as file:
        return {tuple(row[key] for key in KEY): row for row in csv.DictReader(file)}


def write_kept(path: Path, rows: dict[tuple[str, ...], dict[str, str]]) -> None:
    """Write the kept rows, in the order of the bodies."""
    order = {name: i for i, name in enumerate(bodies())}
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            sorted(rows.values(), key=lambda row: (order.get(row["body"], -1), int(row["seed"])))
        )


def mean(rows: list[dict[str, str]], figure: str) -> float:
    return float(np.mean([float(row[figure]) for row in rows]))


def marks(now: list[dict[str, str]], before: list[dict[str, str]]) -> list[str]:
    """What is worse than its bound in the rows of one body."""
    found = []
    lost = [a["seed"] for a, b in zip(now, before, strict=True) if _is_lost(a, b)]
    if lost:
        found.append(f"MET LOST ({', '.join(lost)})")
    for figure, bound in (("p95", 1.1), ("largest", 1.5)):
        if not mean(now, figure) <= bound * mean(before, figure):
            found.append(f"{figure} > {bound} x")
    return found


def _is_lost(now: dict[str, str], before: dict[str, str]) -> bool:
    return before["met"] == "1" and now["met"] != "1"


def print_table(today, kept) -> bool:
    """Print today's figures, the kept ones in brackets; whether all bounds hold."""
    print("| body | " + " | ".join(FIGURES[:-1]) + " | worse |\n|" + "---|" * (len(FIGURES) + 1))
    fine = True
    for name in bodies():
        now = [row for (body, _), row in sorted(today.items()) if body == name]
        if not now:
            continue
        before = [kept[key] for key, row in sorted(today.items()) if row in now and key in kept]
        cells = [_cell(now, before, figure) for figure in FIGURES[:-1]]
        bad = marks(now, before) if len(before) == len(now) else ["no kept figures"]
        fine = fine and not bad
        print(f"| {name} | " + " | ".join(cells) + f" | {'; '.join(bad)} |")
    both = [key for key in today if key in kept]
    for figure in ("touches", "length", "seconds", "patches"):
        a, b = (sum(float(rows[key][figure]) for key in both) for rows in (today, kept))
        worse = figure in ("touches", "seconds") and not a <= b
        fine = fine and not worse
        print(f"sum of {figure}: {a:.5g} ({b:.5g}){' WORSE' if worse else ''}")
    ratios = [float(today[k]["p95"]) / max(float(kept[k]["p95"]), 1e-9) for k in both]
    if ratios:
        print(f"95 % error, median of the ratios: {np.median(ratios):.3f}")
    same = sum(today[key]["bytes"] == kept[key]["bytes"] for key in both)
    print(f"surfaces of the same bytes: {same} of {len(both)}")
    return fine


def _cell(now, before, figure: str) -> str:
    """Figures of the seeds: counts one by one, others as their mean, the kept ones in brackets."""

    def text(rows):
        if figure in ("touches", "met", "euler", "faces", "patches", "manifold"):
            return ", ".join(row[figure] for row in rows)
        return f"{mean(rows, figure):.4g}"

    return f"{text(now)} ({text(before)})" if before else text(now)


def main(arguments: argparse.Namespace) -> int:
    chosen = {
        name: body
        for name, body in bodies().items()
        if (not arguments.only or name in arguments.only)
        and (not arguments.quick or name in QUICK)
        and (OBJECTS.exists() or body.kind != "scan")
    }
    cells = [
        (name, seed)
        for name, body in chosen.items()
        for seed in range(
            1 if arguments.quick or (body.long and not arguments.full) else arguments.seeds
        )
    ]
    today = {}
    for row in rows_of(cells, arguments.workers):
        today[tuple(row[key] for key in KEY)] = row
        words = ", ".join(f"{key} {row[key]}" for key in FIGURES)
        print(f"{row['body']} {row['seed']}: {words}", file=sys.stderr, flush=True)
        if arguments.renew:
            write_kept(arguments.kept, read_kept(arguments.kept) | today)
    kept = read_kept(arguments.kept)
    fine = print_table(today, kept)
    return 0 if fine or arguments.renew else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help=f"{', '.join(QUICK)}, one seed")
    size.add_argument("--full", action="store_true", help="three seeds of the long ones, too")
    parser.add_argument("--only", nargs="+", choices=list(bodies()), metavar="NAME")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--renew", action="store_true", help="keep the rows of today")
    parser.add_argument("--kept", type=Path, default=KEPT, help="file of the kept rows")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    sys.exit(main(parser.parse_args()))
