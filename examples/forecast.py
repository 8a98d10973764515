"""The forecast: the share of the surface within the tolerance, predicted and true, touch by touch.

    python examples/forecast.py [BODY ...] [--seeds 1] [--tolerance F] [--out CSV] [--picture PNG]

Bodies are those of the guard. True is the share of 6,000 points of the true surface at which the
atlas knows the surface and is off by no more than one tolerance; held is the share of the known
ones within the 95 % interval, in each fifth of the predicted deviation, the surest first. The table
has the touch at which the true share first was 0.99 and the last touch, the mean of predicted less
true from the tenth touch on, and what was held at ten touches, half-way, and at the end.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import guard_bodies

from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner import explore
from touchatlas.sim import Probe, RunOptions
from touchatlas.sim.run.work import begin, random_streams

BODIES = (
    *("sphere", "ellipsoid", "bottle", "mouse", "blob", "torus"),
    *("cube", "plate", "T-slot", "fingers", "tube", "roof"),
    *("wedge", "disc", "half ball", "lemon", "mustard", "wing nut"),
)
FIFTHS, ENOUGH = 5, 0.99
HELD = tuple(f"held_{k}" for k in range(1, FIFTHS + 1))
COLUMNS = ("body", "kind", "seed", "touch", "true", "predicted", "known", *HELD)


def shares(atlas, points, tolerance: float) -> dict[str, float]:
    """The true share, the known one, and what intervals hold in each fifth, at points (n, 3)."""
    if atlas.body is None:
        return {"true": 0.0, "known": 0.0} | dict.fromkeys(HELD, np.nan)
    found = atlas.blend(points)
    known = np.flatnonzero(found.known)
    off, deviation = np.abs(found.distance[known]), found.deviation[known]
    order = np.argsort(deviation, kind="stable")
    held = off <= SURE * deviation
    parts = [held[part].mean() if len(part) else np.nan for part in np.array_split(order, FIFTHS)]
    return {
        "true": np.count_nonzero(off <= tolerance) / len(points),
        "known": len(known) / len(points),
        **dict(zip(HELD, parts, strict=True)),
    }


def explored(name: str, seed: int, fraction: float | None = None) -> list[dict[str, object]]:
    """A row for each touch of one exploration, to a tolerance that is a fraction of the diagonal,
    or the body's own."""
    body = guard_bodies.bodies()[name]
    obj, fraction = body.make(), fraction or body.tolerance
    tolerance = obj.tolerance if fraction is None else fraction * obj.diagonal
    probe_rng, _, _, planner_rng = random_streams(seed)
    atlas, planner = begin(RunOptions(obj.noise_std, tolerance, seed=seed), obj, planner_rng)
    probe = Probe(obj, obj.noise_std, probe_rng)
    points, rows = obj.sample(6000, np.random.default_rng(99))[0], []
    for touch, _ in enumerate(explore(atlas, planner, probe, body.most), 1):
        predicted = planner.forecast(atlas).predicted_coverage
        figures = shares(atlas, points, tolerance) | {"predicted": predicted}
        rows.append({"body": name, "kind": body.kind, "seed": seed, "touch": touch} | figures)
    if rows:
        rows[-1]["predicted"] = planner.forecast(atlas).predicted_coverage
    return rows


def line(rows, early: int = 10) -> str:
    """The line of the table for the rows of one exploration, whose early touches are no forecast
    to compare."""
    last, true = len(rows), np.array([row["true"] for row in rows])
    first = int(np.argmax(true >= ENOUGH)) + 1 if (true >= ENOUGH).any() else 0
    late = [row["predicted"] - row["true"] for row in rows[early - 1 :]]
    ends = f"{first or '-'} | {last} | {last / first:.2f}" if first else f"- | {last} | -"
    bias = f"{np.mean(late):+.3f} | {np.abs(late).max():.3f}" if late else "- | -"
    cells = [
        " ".join(f"{rows[k][name]:.2f}" for name in HELD)
        for k in (min(early, last) - 1, last // 2, last - 1)
    ]
    head = f"| {rows[0]['body']} | {rows[0]['seed']} | {ends} | "
    end = f"{rows[-1]['true']:.4f} | {rows[-1]['predicted']:.4f}"
    return f"{head}{end} | {bias} | {' | '.join(cells)} |"


def picture(path: Path, runs) -> None:
    """True and predicted shares touch by touch, a panel for each body."""
    columns = min(6, len(runs))
    lines = -(-len(runs) // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(2.6 * columns, 2.1 * lines), squeeze=False)
    for axis, rows in zip(axes.flat, runs, strict=False):
        touches = [row["touch"] for row in rows]
        for name, style in (("true", "-"), ("predicted", "--")):
            axis.plot(touches, [row[name] for row in rows], style, label=name)
        axis.set_title(f"{rows[0]['body']}, seed {rows[0]['seed']}", fontsize=9)
        axis.set_ylim(0.0, 1.02)
    axes[0, 0].legend(fontsize=8)
    axes[-1, 0].set_xlabel("touch")
    axes[-1, 0].set_ylabel("share within the tolerance")
    for axis in axes.flat[len(runs) :]:
        axis.set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main(arguments: argparse.Namespace) -> int:
    known, scans = guard_bodies.bodies(), guard_bodies.OBJECTS.exists()
    names = [n for n in arguments.bodies or BODIES if scans or known[n].kind != "scan"]
    cells = [(name, seed, arguments.tolerance) for name in names for seed in range(arguments.seeds)]
    print(
        "| body | seed | 0.99 true at | ends at | ratio | true | predicted | mean difference ",
        end="",
    )
    print("| largest | held at 10 | held half-way | held at the end |")
    print("|" + "---|" * 12, flush=True)
    runs = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for rows in pool.map(explored, *zip(*cells, strict=True)):
            runs.append(rows)
            print(line(rows), flush=True)
    if arguments.out:
        with open(arguments.out, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(row for rows in runs for row in rows)
    if arguments.picture:
        picture(arguments.picture, runs)
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bodies", nargs="*", choices=[*guard_bodies.bodies(), []], metavar="BODY")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--tolerance", type=float, help="as a fraction of the diagonal")
    parser.add_argument("--out", type=Path, help="CSV of a row a touch")
    parser.add_argument("--picture", type=Path, help="PNG of the shares")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    sys.exit(main(parser.parse_args()))
