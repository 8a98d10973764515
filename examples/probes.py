"""Real probes beside the ideal one: `probes.py [BODY ...] [--tolerance F ...] [--seeds N]`.

Bodies are those of the guard, and tolerances fractions of the diagonal. Each body is explored with
the ideal probe, with a scanning one that gives contacts and normals, with one that gives centres
of its ball, and with a trigger, whose balls have a radius of one tolerance. The table has the
touches of each seed, how many seeds met the tolerance, and means over them: points, seconds of the
machine, for the ideal probe those of a scanner, the error of 95 % in tolerances, the share of
errors within 1.96 deviations, and processor seconds, the simulation of the probe among them. --out
writes figures after each touch as CSV, --picture draws error and calibration against seconds.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import groupby, product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import guard_bodies

from touchatlas.atlas import extract_surface
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner import explore
from touchatlas.sim import ProbeOptions, RunOptions
from touchatlas.sim.machine.options import SCANNING, cost_of
from touchatlas.sim.machine.simulated_probe import probe_of
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.surface_judge import judged
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.units import millimetre_of

PROBES = {
    "ideal": ProbeOptions(),
    "contacts": ProbeOptions(SCANNING),
    "centres": ProbeOptions(SCANNING, normals=False),
    "trigger": ProbeOptions("trigger"),
}
KEY = "body", "tolerance", "probe", "seed"
COLUMNS = (*KEY, "touch", "points", "machine", "within", "p95", "calibration", "met", "processor")


def explored(name: str, fraction: float, probe: str, seed: int, most: int) -> list[dict]:
    """A row for each touch of one exploration; the last one says whether the tolerance is met."""
    obj = guard_bodies.bodies()[name].make()
    tolerance, options = fraction * obj.diagonal, PROBES[probe]
    if probe != "ideal":
        options = ProbeOptions(options.name, radius=tolerance, normals=options.normals)
    options = RunOptions(obj.noise_std, tolerance, seed=seed, probe=options)
    probe_rng, _, _, planner_rng = random_streams(seed)
    atlas, planner = begin(options, obj, planner_rng)
    machine = probe_of(options, obj, probe_rng)
    unit = obj.unit if isinstance(obj, MeshObject) else "mm"
    cost = cost_of(PROBES["contacts"], millimetre_of(unit, obj.diagonal))
    points, rows, scanned = obj.sample(6000, np.random.default_rng(99))[0], [], 0.0
    begun = time.process_time()
    for step in explore(atlas, planner, machine, most):
        touch = step.touch
        scanned += touch.tracked_length / cost.feed + touch.travel_length / cost.rapid + cost.touch
        figures = {"touch": len(rows) + 1, "points": atlas.point_count}
        figures["machine"] = getattr(machine, "seconds", scanned)
        figures |= errors(atlas, points, tolerance)
        rows.append(dict(zip(KEY, (name, fraction, probe, seed), strict=True)) | figures)
    atlas.finish()
    surface = extract_surface(atlas)
    rows[-1]["processor"] = time.process_time() - begun
    rows[-1]["met"] = int(judged((surface.vertices, surface.faces), obj, points, tolerance)["met"])
    return rows


def errors(atlas, points, tolerance: float) -> dict[str, float]:
    """Share of true points (n, 3) known to the tolerance; error of 95 % of the known ones, in
    tolerances; share of them within 1.96 deviations."""
    if atlas.body is None:
        return {"within": 0.0, "p95": np.nan, "calibration": np.nan}
    found = atlas.blend(points)
    off, deviation = np.abs(found.distance[found.known]), found.deviation[found.known]
    return {
        "within": np.count_nonzero(off <= tolerance) / len(points),
        "p95": np.quantile(off, 0.95) / tolerance if len(off) else np.nan,
        "calibration": np.mean(off <= SURE * deviation) if len(off) else np.nan,
    }


def line(runs) -> str:
    """The line of the table for the explorations of some seeds, each the rows of its touches."""
    last = [run[-1] for run in runs]
    head = [str(last[0][key]) for key in KEY[:3]] + [", ".join(str(row["touch"]) for row in last)]
    met = f"{sum(row['met'] for row in last)} of {len(last)}"
    forms = {"points": ".0f", "machine": ".0f", "p95": ".3f", "calibration": ".2f"}
    forms |= {"processor": ".0f"}
    means = [f"{np.mean([row[key] for row in last]):{form}}" for key, form in forms.items()]
    return "| " + " | ".join([*head, met, *means]) + " |"


def picture(path: Path, rows) -> None:
    """Error and calibration against machine seconds, a column for each body and tolerance."""
    runs = [list(own) for _, own in groupby(rows, lambda row: [row[key] for key in KEY])]
    cells = list(dict.fromkeys((run[0]["body"], run[0]["tolerance"]) for run in runs))
    figure, axes = plt.subplots(
        2, len(cells), figsize=(3.0 * len(cells), 5.0), squeeze=False, sharex="col"
    )
    for run in runs:
        column = cells.index((run[0]["body"], run[0]["tolerance"]))
        style = {"color": f"C{list(PROBES).index(run[0]['probe'])}", "lw": 1.2}
        seconds = [row["machine"] for row in run]
        label = None if run[0]["seed"] or column else run[0]["probe"]
        for axis, key in zip(axes[:, column], ("p95", "calibration"), strict=True):
            axis.plot(seconds, [row[key] for row in run], label=label, **style)
    for (body, fraction), (upper, lower) in zip(cells, axes.T, strict=True):
        upper.set(title=f"{body}, {fraction:g} of the diagonal", yscale="log")
        upper.axhline(1.0, color="0.6", lw=0.8)
        lower.axhline(0.95, color="0.6", lw=0.8)
        lower.set(xlabel="seconds of the machine", ylim=(0.0, 1.03))
    axes[0, 0].set_ylabel("error of 95 %, tolerances")
    axes[1, 0].set_ylabel("share within 1.96 deviations")
    axes[0, 0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main(arguments: argparse.Namespace) -> None:
    cells = [
        *product(arguments.bodies, arguments.tolerance, arguments.probes, range(arguments.seeds))
    ]
    names = *KEY[:3], "touches", "met", "points", "machine", "p95", "calibration", "processor"
    print("| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|", flush=True)
    rows, runs = [], []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for own in pool.map(explored, *zip(*cells, strict=True), [arguments.most] * len(cells)):
            rows, runs = rows + own, [*runs, own]
            if arguments.out:
                with open(arguments.out, "w", newline="", encoding="utf-8") as file:
                    writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                    writer.writeheader()
                    writer.writerows(rows)
            if len(runs) % arguments.seeds == 0:
                print(line(runs[-arguments.seeds :]), flush=True)
    if arguments.picture:
        picture(arguments.picture, rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bodies", nargs="*", default=["bottle", "cube"], metavar="BODY")
    parser.add_argument("--tolerance", nargs="+", type=float, default=[1e-3])
    parser.add_argument("--probes", nargs="+", choices=list(PROBES), default=list(PROBES))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--most", type=int, default=60, help="touches")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, help="file of a row for each touch")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    guard_bodies.check_names(parser, arguments.bodies, guard_bodies.bodies())
    main(arguments)
