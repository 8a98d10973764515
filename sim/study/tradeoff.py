"""Accuracy against speed of one patch from three curves: our methods, the paper's, peers'.

Every method gets the same touches: three curves of 19 points at a random reference point, in
planes 60 degrees apart, with noise. It is judged on nine other curves, exact, as in the paper's
section 2.4, and on the exact principal curvatures.
"""

import math
import time
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from touchatlas.patch import Patch
from touchatlas.patch.entry_points import ESTIMATORS, added
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.study.cells import Cell, Row
from touchatlas.sim.study.figures import canvas
from touchatlas.sim.study.fits import (
    FITS,
    PAPER,
    Fit,
    added_fits,
    height_error,
    mesh_around,
    mesh_curvatures,
)
from touchatlas.sim.study.scenes import SURFACES, Scene, draw_scene
from touchatlas.sim.study.study import Chart, Study
from touchatlas.sim.study.tables import Summed, grouped, number

MEASURES = (
    *("mean_error", "max_error", "curvature_error", "time_ratio"),
    *("within", "curvature_within"),
)
FRACTIONS = ("within", "curvature_within")
COLUMNS = ("method", "surface", "noise", "planes", "draws", *MEASURES, "seed", "note")
KIND = ("surface", "noise", "planes")
# Curvatures of a mesh of 271 samples instead of 57.
MESH = "igl_mesh"
_SHOWN = {
    "mean_error": "mean error",
    "max_error": "max error",
    "curvature_error": "k error",
    "time_ratio": "time",
    "within": "within",
    "curvature_within": "k within",
    "error_to_paper": "over (5)",
}


def measure_cell(
    surface: str, noise: float, planes: str, draws: int, seed: int, others: Sequence[str] = ()
) -> list[Row]:
    """The rows of one kind of scene, one a method: errors in length (curvatures: relative to the
    largest, or to 1/reach where that is more) and times in bare least-squares solves of 57 x 15,
    medians over the draws; fractions within 1.96 standard deviations, means. Blank where a method
    has no answer. ``planes`` are normal, or tilted by up to 30
    degrees; ``others`` are estimators that other packages add."""
    tilted, fits = planes == "tilted", FITS | added_fits(others)
    rng = np.random.default_rng([seed, *f"{surface} {noise!r} {planes}".encode()])
    problem = rng.normal(size=(57, 15)), rng.normal(size=57)
    scores: dict[str, list[dict]] = {name: [] for name in (*fits, MESH)}
    for scene_rng, peer_rng in (rng.spawn(2) for _ in range(draws)):
        scene = draw_scene(surface, noise, np.pi / 6.0 if tilted else 0.0, scene_rng)
        _, bare = timed(lambda p: np.linalg.lstsq(p[0], p[1], rcond=None), problem)
        for name, own in scores.items():
            score, seconds = _scored(fits.get(name), scene, peer_rng)
            own.append(score | {"time_ratio": seconds / bare})
    head = {"surface": surface, "noise": repr(noise), "planes": planes, "draws": str(draws)}
    return [
        {"method": name, **head}
        | {k: "" if math.isnan(v) else repr(v) for k, v in middles(scores[name]).items()}
        | {"seed": str(seed), "note": ""}
        for name in scores
    ]


def _scored(fit: Fit | None, scene: Scene, rng) -> tuple[dict[str, float], float]:
    """Measures of a fit, and its seconds; without one of a mesh, whose are of one vertex."""
    if fit is None:
        mesh = mesh_around(scene, rng)
        curvatures, seconds = timed(lambda found: mesh_curvatures(*found), mesh)
        return _curvature_measure(curvatures[0], scene), seconds / len(mesh[0])
    found, seconds = timed(lambda s: fit(s.contact, s.contours, s.normal), scene)
    return judged_patch(found, scene), seconds


def judged_patch(found, scene: Scene) -> dict[str, float]:
    """All measures of a patch or a jet but its time."""
    heights = np.abs(height_error(found, scene.verifying))
    measures = {"mean_error": float(heights.mean()), "max_error": float(heights.max())}
    if isinstance(found, Patch):
        known = found.curvatures
        k1, k2, distance = known.k1, known.k2, np.abs(found.signed_distance(scene.verifying))
        off = np.abs(np.array([k1, k2]) - [scene.k1, scene.k2])
        measures["within"] = float(np.mean(distance <= SURE * found.deviation(scene.verifying)))
        measures["curvature_within"] = float(np.mean(off <= SURE * known.std))
    else:
        k1, k2 = found.k1, found.k2
    return measures | _curvature_measure((k1, k2), scene)


def _curvature_measure(curvatures, scene: Scene) -> dict[str, float]:
    error = np.array(curvatures) - [scene.k1, scene.k2]
    size = max(abs(scene.k1), abs(scene.k2), 1.0 / scene.reach)
    return {"curvature_error": float(np.sqrt(np.mean(error**2)) / size)}


def timed(call: Callable[[Any], Any], argument, repeats: int = 3, slow: float = 0.02):
    """A call's answer, and the median time in seconds of some repeats after it; of a call that is
    slower than ``slow`` seconds, its own time."""
    # Processor time, which others on the machine leave as it is, where it is fine enough.
    fine = time.get_clock_info("process_time").resolution < 1e-5
    clock = time.process_time if fine else time.perf_counter
    times: list[float] = []
    answer = None
    for _ in range(1 + repeats):
        start = clock()
        answer = call(argument)
        times.append(clock() - start)
        if times[0] > slow:
            return answer, times[0]
    return answer, float(np.median(times[1:]))


def middles(rows: list[dict]) -> dict[str, float]:
    """Medians of the measures over rows, means of those that are fractions; NaN where missing."""
    values = {name: [_value(row.get(name, "")) for row in rows] for name in MEASURES}
    return {
        name: float(np.mean(found) if name in FRACTIONS else np.median(found))
        for name, found in values.items()
    }


def _value(cell) -> float:
    return np.nan if cell == "" else float(cell)


def summary(rows: list[Row]) -> Summed:
    """One row a method: its rows in all cells summed up by ``middles``, and medians of its
    ``error_to_paper`` and ``time_to_paper``, over the paper's (5) by descent in the same cell."""
    paper = {key: own[0] for key, own in grouped(rows, "method", *KIND).items() if key[0] == PAPER}
    summed = []
    for (method,), own in grouped(rows, "method").items():
        ratios = {}
        for ratio, of in (("error_to_paper", "mean_error"), ("time_to_paper", "time_ratio")):
            theirs = [paper.get((PAPER, *(row[n] for n in KIND)), {}).get(of, "") for row in own]
            found = [number(r[of]) / number(p) for r, p in zip(own, theirs, strict=True)]
            ratios[ratio] = float(np.median(found))
        summed.append({"method": method, **middles(own), **ratios})
    return summed


def table(rows: list[Row], summed: Summed) -> Table:
    """Medians over all cells, one row a method."""
    kinds = len(grouped(rows, *KIND))
    title = f"{kinds} kinds of scenes, draws of each: {rows[0]['draws']}"
    caption = (
        f"errors in mm, of k relative; times in bare 57 x 15 least squares; last: mean error over "
        f"that of the paper's (5) by {PAPER} in the same scenes; within: 1.96 deviations"
    )
    shown = Table(title=title, caption=caption, box=SIMPLE)
    shown.add_column("method", no_wrap=True)
    for header in _SHOWN.values():
        shown.add_column(header, justify="right")
    for row in summed:
        shown.add_row(row["method"], *(_shown(name, row[name]) for name in _SHOWN))
    return shown


def _shown(name: str, value: float) -> str:
    if math.isnan(value):
        return ""
    if name in FRACTIONS:
        return f"{value:.0%}"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


def picture(rows: list[Row], summed: Summed):
    """Accuracy against time: small markers are cells, large ones medians over the cells, the
    line is the front that no method beats in both."""
    figure = canvas(13, 6)
    labels = {
        "mean_error": "mean height error on nine other curves (mm)",
        "curvature_error": "relative error of the principal curvatures",
    }
    cells = grouped(rows, "method")
    for axes, (measure, label) in zip(figure.subplots(1, 2), labels.items(), strict=True):
        axes.set(xscale="log", yscale="log", ylabel=label)
        axes.set_xlabel("time of one fit / bare 57 x 15 least squares")
        axes.grid(alpha=0.25)
        for place, row in enumerate(summed):
            style = {"marker": "osD^vP*Xh<>p"[place % 12], "color": f"C{place % 10}"}
            own = cells[row["method"],]
            points = [[number(r[name]) for r in own] for name in ("time_ratio", measure)]
            axes.scatter(*points, s=12, alpha=0.35, linewidths=0, **style)
            large = {"s": 130, "edgecolors": "black", "label": row["method"], **style}
            axes.scatter(row["time_ratio"], row[measure], **large)
        front = pareto_front([(row["time_ratio"], row[measure]) for row in summed])
        axes.plot(*np.array(front).T, color="black", lw=1.2, zorder=1)
    handles, words = figure.axes[-1].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=min(len(words), 6))
    return figure


def pareto_front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points that no other beats in both, by growing first coordinate.

    >>> pareto_front([(1.0, 5.0), (2.0, 6.0), (3.0, 1.0), (2.5, math.nan)])
    [(1.0, 5.0), (3.0, 1.0)]
    """
    front: list[tuple[float, float]] = []
    for point in sorted(p for p in points if all(map(math.isfinite, p))):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front


def cells(names: tuple[str, ...], draws: int, seed: int) -> list[Cell]:
    """A cell of each surface, noise and kind of planes."""
    found, others = [], (list(added(ESTIMATORS)),) if added(ESTIMATORS) else ()
    for surface, noise, planes in product(
        names or SURFACES, (0.0, 0.02, 0.05), ("normal", "tilted")
    ):
        head = {"surface": surface, "noise": repr(noise), "planes": planes}
        head |= {"draws": str(draws), "seed": str(seed)}
        found.append(Cell("tradeoff.csv", head, (surface, noise, planes, draws, seed, *others)))
    return found


TRADEOFF = Chart(
    Study("tradeoff", COLUMNS, measure_cell, "note"),
    *(cells, summary, lambda rows, summed: {"tradeoff": picture(rows, summed)}, table, 50),
    suffixes=("png",),
    words=("charting", "cells"),
)
