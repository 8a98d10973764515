"""Fill the tables of the documents from the kept CSV files: `measurements.py [--check]`.

A table stands in a document of docs between the lines `<!-- table NAME -->` and `<!-- end -->`.
--check writes nothing, and ends with 1 where a document is not what this script makes of it.

| table | of the file | which is written by |
|---|---|---|
| guard, failures | docs/guard.csv | python examples/guard.py --renew |
| faults | docs/stability/faults.csv | touchatlas study examples/faults.toml (runs.csv) |
| families, methods | docs/stability/patch.csv | touchatlas chart --stability (stability.csv) |
| patches | docs/tradeoff/patch.csv | touchatlas chart (tradeoff.csv) |
| benchmark | docs/tradeoff/benchmark.csv | touchatlas study (runs.csv) |
| planners | docs/tradeoff/atlas.csv | touchatlas chart --atlas OBJECT ... (atlas.csv) |
"""

import argparse
import csv
import re
import sys
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import numpy as np

DOCS = Path(__file__).parents[1] / "docs"
MARKED = re.compile(r"(<!-- table ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)
Row = dict[str, str]
# Shares of a surface by which a forecast may be off, and least calibration, that are no failure.
FORECAST, CALIBRATION = 0.01, 0.9


def table(headers: list[str], rows: list[list[str]]) -> str:
    lines = [headers, ["---"] * len(headers), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def grouped(rows: list[Row], key: str) -> list[tuple[str, list[Row]]]:
    """Rows by a column, in the order of its first values."""
    order = {name: k for k, name in enumerate(dict.fromkeys(row[key] for row in rows))}
    rows = sorted(rows, key=lambda row: order[row[key]])
    return [(name, list(own)) for name, own in groupby(rows, lambda row: row[key])]


def numbers(rows: list[Row], key: str) -> np.ndarray:
    return np.array([float(row[key] or "nan") for row in rows])


def middle(rows: list[Row], key: str) -> float:
    values = numbers(rows, key)
    return float(np.median(values[np.isfinite(values)])) if np.isfinite(values).any() else np.nan


def short(value: float) -> str:
    if not np.isfinite(value):
        return "–"
    return np.format_float_positional(value, 2, fractional=False, trim="-")


def every(rows: list[Row], key: str) -> str:
    """All values of a column, or one where all are equal."""
    values = [row[key] for row in rows]
    return values[0] if len(set(values)) == 1 else ", ".join(values)


def guard(rows: list[Row]) -> str:
    """One row a body, with the seeds side by side; and the sums of all."""
    cells = []
    for kind, of_kind in grouped(rows, "kind"):
        for name, own in grouped(of_kind, "body"):
            met = sum(row["met"] == "1" for row in own)
            euler = every(own, "euler") + f" ({every(own, 'true_euler')})"
            seconds = numbers(own, "seconds").sum() / max(numbers(own, "touches").sum(), 1.0)
            cells.append(
                [name, kind, ", ".join(row["touches"] for row in own), f"{met} of {len(own)}"]
                + [f"{numbers(own, 'within').min():.4f}", short(numbers(own, "p95").max())]
                + [short(numbers(own, "largest").max())]
                + [f"{numbers(own, 'calibration').min():.2f}", euler]
                + [every(own, "faces"), every(own, "patches"), f"{seconds:.2f}"]
                + [f"{numbers(own, 'megabytes').max():.0f}"]
            )
    headers = ["body", "kind", "touches", "met", "within, least", "95 %, largest", "largest"]
    headers += ["calibration, least", "Euler (true)", "faces", "patches", "s a touch", "MB"]
    met = int((numbers(rows, "met") == 1.0).sum())
    touches, seconds = numbers(rows, "touches").sum(), numbers(rows, "seconds").sum()
    words = f"In sum {len(rows)} explorations, {met} of them met, {touches:.0f} touches, "
    return f"{words}{seconds:.0f} s of processor.\n\n{table(headers, cells)}"


def failures(rows: list[Row]) -> str:
    """Explorations that did not meet the tolerance, or whose result claims too much."""
    cells = []
    for row in rows:
        said = []
        if row["met"] != "1":
            said.append("not met")
        if float(row["predicted"]) - float(row["within"]) > FORECAST:
            said.append("predicts too much")
        if float(row["calibration"]) < CALIBRATION:
            said.append("deviations too small")
        if row["euler"] != row["true_euler"] and row["true_euler"] not in ("None", "nan", ""):
            said.append(f"Euler characteristic {row['euler']} ({row['true_euler']})")
        if row["manifold"] != "1":
            said.append("no manifold")
        if said:
            figures = [row[key] for key in ("within", "predicted", "p95", "largest", "calibration")]
            cells.append([row["body"], row["seed"], row["touches"], *figures, ", ".join(said)])
    headers = ["body", "seed", "touches", "within", "predicted", "95 %", "largest", "calibration"]
    return table([*headers, "what"], cells) if cells else "None.\n"


def faults(rows: list[Row]) -> str:
    """One row a fault and body, with the seeds side by side."""
    cells = []
    for fault, of_fault in grouped(rows, "fault"):
        for body, own in grouped(of_fault, "object"):
            largest = numbers(own, "completeness_max") / numbers(own, "tolerance_used")
            figures = [every(own, "touches"), every(own, "ended")]
            for key in ("predicted_coverage", "coverage", "deviation_calibration"):
                figures.append(", ".join(f"{value:.3g}" for value in numbers(own, key)))
            figures.insert(4, ", ".join(short(value) for value in largest))
            named = [row["touches_to_fault"] or "–" for row in own]
            doubts = dict.fromkeys(", ".join(row["doubts"] for row in own).split(", "))
            words = ", ".join(name for name in doubts if name) or "none"
            cells.append([fault or "none", body, *figures, ", ".join(named), words])
    headers = ["fault", "body", "touches", "ended", "predicted", "true share", "largest"]
    return table([*headers, "calibration", "named after", "doubts"], cells)


def families(rows: list[Row]) -> str:
    """One row a family of one patch, the default method, where more than 1 % is wrong."""
    own = [row for row in rows if row["method"] == "map" and row["family"] != "all"]
    own = [row for row in own if float(row["wrong"]) > 0.01]
    keys = "good", "flagged", "refused", "wrong"
    cells = []
    for row in sorted(own, key=lambda row: (-float(row["wrong"]), row["family"])):
        share = [f"{100.0 * float(row[key]):.1f} %" for key in keys]
        cells.append([f"`{row['family']}`", *share, f"{float(row['held']):.2f}"])
    return table(["family", *keys, "held"], cells)


def methods(rows: list[Row]) -> str:
    """One row a method, all families together."""
    keys = "good", "flagged", "refused", "wrong", "crashed", "good but doubted", "three noises"
    own = [row for row in rows if row["family"] == "all"]
    cells = [[f"`{row['method']}`", *(f"{100 * float(row[k]):.1f} %" for k in keys)] for row in own]
    return table(["method", *keys[:-1], "heights within 3 noises"], cells)


def patches(rows: list[Row]) -> str:
    """One row a method: medians over the kinds of scenes, of which each has a row a method."""
    scene = ("surface", "noise", "planes")
    paper = {
        tuple(row[key] for key in scene): float(row["mean_error"])
        for row in rows
        if row["method"] == "steepest_descent" and "surface" in row and row["mean_error"]
    }
    rows = [
        {"error_to_paper": _ratio(row, paper.get(tuple(row.get(key, "") for key in scene)))} | row
        for row in rows
    ]
    keys = "mean_error", "max_error", "curvature_error", "time_ratio", "within", "error_to_paper"
    headers = ["method", "mean error", "largest error", "curvature error", "time", "within"]
    cells = [
        [f"`{name}`", *(short(middle(own, key)) for key in keys)]
        for name, own in grouped(rows, "method")
    ]
    return table([*headers, "over the paper's"], cells)


def _ratio(row: Row, other: float | None) -> str:
    """Mean error of a row over another one; blank where either is not known."""
    return f"{float(row['mean_error']) / other}" if other and row["mean_error"] else ""


def planners(rows: list[Row]) -> str:
    """One row a planner: runs that met, and costs of ours over its own where both met."""
    costs = "touches", "length", "length_to_99"
    rows = [
        row | {"length": str(float(row["tracked"]) + float(row["travel"]))}
        if "travel" in row
        else row
        for row in rows
    ]
    key = ("object", "tolerance", "seed")
    ours = {
        tuple(row[k] for k in key): row
        for row in rows
        if row["method"] == "tolerance" and row["met"] == "yes"
    }
    cells = []
    for name, own in grouped(rows, "method"):
        met = [row for row in own if row["met"] == "yes"]
        both = [row for row in met if tuple(row[k] for k in key) in ours]
        ratio = [
            np.median(
                [
                    float(ours[tuple(row[k] for k in key)][cost]) / float(row[cost])
                    for row in both
                    if row.get(cost)
                ]
                or [np.nan]
            )
            for cost in costs
        ]
        cells.append([f"`{name}`", f"{len(met)} of {len(own)}", *map(short, ratio)])
    return table(["planner", "met", "touches", "length", "length to 99 %"], cells)


def benchmark(rows: list[Row]) -> str:
    """A table for each tolerance: see ``at_one_tolerance``."""
    parts = []
    for tolerance, own in grouped(rows, "tolerance"):
        words = tolerance.replace(" diagonal", " of the diagonal")
        parts.append(f"To {words}:\n\n{at_one_tolerance(own)}")
    return "\n".join(parts)


def at_one_tolerance(rows: list[Row]) -> str:
    """One row a planner: touches of each object, and the median shares of the gap from random to
    oracle that it closes, in touches and machine seconds, where all three met the tolerance and
    random is the worse of both."""
    cost = {(r["object"], r["planner"], k): float(r[k]) for r in rows for k in _COSTS}
    objects = list(dict.fromkeys(row["object"] for row in rows))
    met_by = {(row["object"], row["planner"]) for row in rows if row["met"] == "1"}
    cells = []
    for planner, own in grouped(rows, "planner"):
        scores = []
        three = "random", planner, "oracle"
        common = [o for o in objects if all((o, p) in met_by for p in three)]
        for k in _COSTS:
            ends = [[cost[o, p, k] for o in common] for p in three]
            most, mine, least = map(np.array, ends)
            worse = most > least
            scores.append(f"{np.median(((most - mine) / (most - least))[worse]):.2f}")
        met = sum(row["met"] == "1" for row in own)
        touches = [row["touches"] for row in own]
        cells.append([f"`{planner}`", f"{met} of {len(own)}", *touches, *scores])
    return table(["planner", "met", *objects, "score, touches", "score, machine seconds"], cells)


_COSTS = ("touches", "machine_seconds")
# The file of each table, in docs, and what makes it of the rows.
TABLES: dict[str, tuple[str, Callable[[list[Row]], str]]] = {
    "guard": ("guard.csv", guard),
    "failures": ("guard.csv", failures),
    "faults": ("stability/faults.csv", faults),
    "families": ("stability/patch.csv", families),
    "methods": ("stability/patch.csv", methods),
    "patches": ("tradeoff/patch.csv", patches),
    "planners": ("tradeoff/atlas.csv", planners),
    "benchmark": ("tradeoff/benchmark.csv", benchmark),
}


def made(name: str, docs: Path = DOCS) -> str:
    """A table by its name; a sentence where its file is not there."""
    file, make = TABLES[name]
    if not (docs / file).exists():
        return f"\nNot measured: docs/{file} is not there.\n\n"
    with open(docs / file, newline="", encoding="utf-8") as opened:
        return f"\n{make(list(csv.DictReader(opened)))}\n"


def filled(text: str, docs: Path = DOCS) -> str:
    """A document with its tables made anew."""
    return MARKED.sub(lambda found: found[1] + made(found[2], docs) + found[3], text)


def main(arguments: argparse.Namespace) -> int:
    stale = []
    for path in sorted(DOCS.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        after = filled(before)
        if after != before:
            stale.append(path.name)
            if not arguments.check:
                path.write_text(after, encoding="utf-8")
    print(", ".join(stale) or "all documents are up to date")
    return int(bool(stale) and arguments.check)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    sys.exit(main(parser.parse_args()))
