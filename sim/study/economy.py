"""What a tolerance takes: the error of whole surfaces against touches, lengths and time.

Every object is explored to every tolerance by every planner, by one that knows the truth, and made
by others from the touches of ours.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from rich.box import SIMPLE
from rich.table import Table

from touchatlas.patch.entry_points import PLANNERS, added
from touchatlas.planner import PlannerOptions
from touchatlas.planner.options import NAMES
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.work import random_streams
from touchatlas.sim.study.cells import Cell, Row
from touchatlas.sim.study.compare import gap_closed
from touchatlas.sim.study.course import Course, explored
from touchatlas.sim.study.study import (
    Chart,
    Study,
    Summed,
    canvas,
    grouped,
    middle,
    number,
    plain_numbers,
)
from touchatlas.sim.study.surface_peers import PEERS, best_surface, distances, samples_of
from touchatlas.sim.study.tradeoff import pareto_front
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.triangles import sample_triangles

OURS, ORACLE = "tolerance", "oracle"
# Surfaces by others from the touches of our planner, where their package is present.
OTHERS = ("APSS", "RIMLS", "Poisson")
COLUMNS = (
    *("object", "tolerance", "method", "seed", "touches", "tracked", "travel", "seconds"),
    *("mean_error", "p95_error", "known_share", "met", "ended"),
    *("touches_to_99", "length_to_99"),
)
KEY = COLUMNS[:4]


@dataclass(frozen=True)
class EconomyOptions:
    """How far runs go, and how their surfaces are judged.

    Parameters
    ----------
    objects : tuple of str
        Those that are explored where none is named.
    tolerances : tuple of float
        Fractions of the diagonal,
    least_noises : float
        of which those below so many standard deviations of the noise are left out.
    most : int
        Touches after which a run ends.
    points : int
        At which either surface is compared with the other: the standard error of a share of 0.99
        is 0.001.
    share, off : float
        A surface that meets the tolerance has this share of the truth within it, and the same
        share of its own points within so many tolerances.
    sagitta : float
        By which the truth's triangles may be off, in tolerances.
    cells : int
        Of others' grids along the longest side.
    """

    objects: tuple[str, ...] = ("ellipsoid", "blob")
    tolerances: tuple[float, ...] = (1e-3, 3e-3, 1e-2, 3e-4)
    least_noises: float = 2.0
    most: int = 120
    points: int = 8000
    share: float = 0.99
    off: float = 2.0
    sagitta: float = 0.02
    cells: int = 48


OPTIONS = EconomyOptions()


def measure_run(name: str, tolerance: float, method: str, seed: int) -> list[Row]:
    """The row of one exploration, and those of others on our planner's touches.

    Lengths are in diagonals of the object, of which the tolerance is a fraction.
    """
    obj = make_object(name, seed)
    options = RunOptions(
        *(obj.noise_std, tolerance * obj.diagonal, OPTIONS.most),
        seed=seed,
        planner=PlannerOptions(method),
    )
    truth = obj.sample(OPTIONS.points, random_streams(seed)[1])[0]
    course = explored(obj, options, truth)
    atlas, surface = course.atlas, course.surface
    mesh = None if surface is None else (surface.vertices, surface.faces)
    head = {"object": name, "tolerance": repr(tolerance), "method": method, "seed": str(seed)}
    rows = [head | _cells(course, judged(mesh, obj, truth, atlas.tolerance), obj.diagonal)]
    if method != OURS or not len(atlas):
        return rows
    samples, alone = samples_of(atlas, course.touches), replace(course, shares=[])
    for other in [one for one in OTHERS if PEERS[one].present()]:
        found = best_surface(PEERS[other], *samples, obj.noise_std, OPTIONS.cells, truth)
        if found is not None:
            theirs = replace(alone, seconds=course.seconds + found[2])
            judgement = judged(found[0], obj, truth, atlas.tolerance)
            rows.append(head | {"method": other} | _cells(theirs, judgement, obj.diagonal))
    return rows


def _cells(course: Course, judgement: dict[str, float], unit: float) -> Row:
    """Columns of a course and its judgement; lengths over a unit; blank where unknown."""
    tracked = [touch.tracked_length / unit for touch in course.touches]
    travel = [touch.travel_length / unit for touch in course.touches]
    first = course.reached(OPTIONS.share)
    numbers = {
        "tracked": float(sum(tracked)),
        "travel": float(sum(travel)),
        "seconds": course.seconds,
        "mean_error": judgement["mean_error"] / unit,
        "p95_error": judgement["p95_error"] / unit,
        "known_share": judgement["known_share"],
        "touches_to_99": np.nan if first is None else float(first),
        "length_to_99": np.nan if first is None else sum(tracked[:first]) + sum(travel[:first]),
    }
    words = {"met": "yes" if judgement["met"] else "no", "ended": course.ended}
    found = {name: "" if math.isnan(x) else f"{x:.5g}" for name, x in numbers.items()}
    return {"touches": str(len(course.touches))} | found | words


def judged(
    mesh: tuple[np.ndarray, np.ndarray] | None,
    obj,
    truth,
    tolerance: float,
    options: EconomyOptions = OPTIONS,
) -> dict[str, float]:
    """``mean_error``, ``p95_error`` (truth to surface, length), ``known_share`` and ``met``.

    Met: 99 % of the truth within the tolerance, 99 % of the surface within twice of it,
    watertight, right Euler characteristic.

    Parameters
    ----------
    mesh : vertices (v, 3) and faces (f, 3), or None
    obj : the object
    truth : (n, 3) float, length
        Points of its surface.
    tolerance : float, length
    options : EconomyOptions
    """
    if mesh is None or not len(mesh[1]):
        return {"mean_error": np.nan, "p95_error": np.nan, "known_share": 0.0, "met": 0.0}
    missed = distances(*mesh, truth)
    share = float(np.mean(missed <= tolerance))
    points = sample_triangles(*mesh, options.points, np.random.default_rng(0))[0]
    vertices, faces = obj.mesh(options.sagitta * tolerance)
    off = np.quantile(distances(vertices, faces, points), options.share)
    body = trimesh.Trimesh(*mesh, process=False)
    right = not obj.closed or body.is_watertight
    right = right and body.euler_number == obj.euler_characteristic
    return {
        "mean_error": float(missed.mean()),
        "p95_error": float(np.quantile(missed, 0.95)),
        "known_share": share,
        "met": float(right and share >= options.share and off <= options.off * tolerance),
    }


def cells_of(names, draws: int, seed: int, methods=None, options=OPTIONS) -> list[Cell]:
    """A run of each object, tolerance, planner and seed whose noise allows the tolerance.

    ``names`` are of built-in objects, or paths of mesh files; ``draws`` is the number of seeds.
    ValueError for what is no object.
    """
    noise, methods = {}, methods or (*NAMES, *added(PLANNERS))
    for name in names or options.objects:
        obj = make_object(name)
        noise[name] = obj.noise_std / obj.diagonal
    found = []
    for one_seed in range(seed, seed + draws):
        for tolerance in options.tolerances:
            for name, least in noise.items():
                if tolerance >= options.least_noises * least:
                    given = [(name, tolerance, method, one_seed) for method in methods]
                    found += [Cell("atlas.csv", _head(*one), one) for one in given]
    return found


def _head(name: str, tolerance: float, method: str, seed: int) -> Row:
    return dict(zip(KEY, (name, repr(tolerance), method, str(seed)), strict=True))


# What a run took: to its own end, and until 99 % of the truth was first within the tolerance.
COSTS: dict[str, Callable[[Row], float]] = {
    "touches": lambda row: number(row["touches"]),
    "tracked": lambda row: number(row["tracked"]),
    "length": lambda row: number(row["tracked"]) + number(row["travel"]),
    "seconds": lambda row: number(row["seconds"]),
    "touches to 99 %": lambda row: number(row["touches_to_99"]),
    "length to 99 %": lambda row: number(row["length_to_99"]),
}


def summary(rows: list[Row]) -> Summed:
    """One row a method: ``method``, ``runs``, ``met``, and for each of the ``COSTS`` the median of
    ours over its own, over the runs of same object, tolerance and seed that both met; NaN where
    there is none."""
    found = []
    for (method,), own in grouped(rows, "method").items():
        head = {"method": method, "runs": len(own), "met": sum(r["met"] == "yes" for r in own)}
        ratios = {
            name: middle(ours / other for ours, other in pairs(rows, method, cost))
            for name, cost in COSTS.items()
        }
        found.append(head | ratios)
    return found


def pairs(rows: list[Row], method: str, cost: Callable[[Row], float]) -> list[tuple[float, float]]:
    """(ours, the method's) costs of the runs of same object, tolerance and seed, both met."""
    ours, others = _met(rows, OURS), _met(rows, method)
    return [(cost(ours[key]), cost(others[key])) for key in ours if key in others]


def _met(rows: list[Row], method: str) -> dict[tuple[str, ...], Row]:
    """The runs of a method that met the tolerance, by object, tolerance and seed."""
    own = [row for row in rows if row["method"] == method and row["met"] == "yes"]
    return {(row["object"], row["tolerance"], row["seed"]): row for row in own}


def table(rows: list[Row], summed: Summed) -> Table:
    """One row a method: runs, those that met, and what ours took over what it took."""
    shown = Table(
        title="cost of ours over that of the method, median of the runs that both met",
        caption="length: tracked plus travel; *: until 99 % of the truth is within the tolerance, "
        "whether the planner knows it or not; gap closed: 0 as random, 1 as oracle",
        box=SIMPLE,
        pad_edge=False,
        collapse_padding=True,
    )
    shown.add_column("method", no_wrap=True)
    for header in ("met", *COSTS):
        shown.add_column(header.replace(" to 99 %", "*"), justify="right", no_wrap=True)
    same = ("object", "tolerance", "seed")
    gaps = {n: middle(gap_closed(rows, same, "method", OURS, cost)) for n, cost in COSTS.items()}
    for row in [*summed, {"method": "gap closed", **gaps}]:
        counts = f"{row['met']}/{row['runs']}" if "runs" in row else ""
        cells = ("" if math.isnan(row[name]) else f"{row[name]:.2f}" for name in COSTS)
        shown.add_row(row["method"], counts, *cells)
    return shown


# Colours of Okabe and Ito, which differ for all kinds of colour vision, with grey, and markers
# besides.
STYLES = {
    "tolerance": ("#0072B2", "o"),
    "oracle": ("#000000", "*"),
    "random": ("#999999", "s"),
    "farthest": ("#009E73", "D"),
    "variance": ("#CC79A7", "^"),
    "APSS": ("#56B4E9", "P"),
    "RIMLS": ("#D55E00", "X"),
    "Poisson": ("#F0E442", "h"),
}
# Of planners that packages add.
_MORE = (("#E69F00", "v"), ("#882255", "<"), ("#44AA99", ">"), ("#999933", "p"), ("#332288", "d"))
_CHARTED = {
    "touches": "touches",
    "tracked": "tracked length / diagonal",
    "length": "tracked + travel length / diagonal",
    "seconds": "compute, processor seconds",
}
_ERRORS: dict[str, Callable[[Row], float]] = {
    "mean error / diagonal": lambda row: number(row["mean_error"]),
    "95th percentile of error / diagonal": lambda row: number(row["p95_error"]),
    # Half of one of 8,000 true points stands for none, which has no logarithm.
    "share of truth not within the tolerance": lambda row: max(
        1.0 - number(row["known_share"]), 0.5 / OPTIONS.points
    ),
}


def styles(rows: list[Row]) -> dict[str, tuple[str, str]]:
    """Colour and marker of each method of some rows, ours first."""
    there = [method for (method,) in grouped(rows, "method")]
    more = [method for method in there if method not in STYLES]
    found = {method: style for method, style in STYLES.items() if method in there}
    return found | {method: _MORE[k % len(_MORE)] for k, method in enumerate(more)}


def pictures(rows: list[Row], summed: Summed) -> dict:
    """A picture of each object, and one of all."""
    named = {Path(name).stem: own for (name,), own in grouped(rows, "object").items()}
    drawn = {name: object_picture(name, own) for name, own in named.items()}
    return drawn | {"atlas": overview_picture(rows)}


def object_picture(name: str, rows: list[Row]):
    """One object's rows: each run a point, hollow where it did not meet its tolerance; a line
    through the medians of a method; the front that none but the oracle beats."""
    from matplotlib.lines import Line2D

    figure = canvas(15.0, 10.5)
    grid = figure.subplots(len(_ERRORS), len(_CHARTED), sharex="col", sharey="row")
    for place, (line, (title, error)) in enumerate(zip(grid, _ERRORS.items(), strict=True)):
        for axes, cost in zip(line, _CHARTED, strict=True):
            # Shares are within different tolerances, so no line joins them.
            _panel(axes, rows, COSTS[cost], error, joined=place < len(grid) - 1)
        line[0].set_ylabel(title)
    for axes, label in zip(grid[-1], _CHARTED.values(), strict=True):
        axes.set_xlabel(label)
    entries = [
        Line2D([], [], color=colour, marker=marker, ms=8, lw=1.2, label=method)
        for method, (colour, marker) in styles(rows).items()
    ]
    front = "Pareto front without the oracle"
    entries.append(Line2D([], [], color="black", lw=1.0, ls="--", label=front))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    words = "each point one run to one tolerance; hollow: tolerance not met"
    figure.suptitle(f"{name}: error of the whole surface against its cost ({words})")
    return figure


def _panel(axes, rows: list[Row], cost, error, joined: bool) -> None:
    """One error against one cost, on logarithmic axes."""
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.25)
    for method, (colour, marker) in styles(rows).items():
        own = [row for row in rows if row["method"] == method]
        for row in own:
            face, size = colour if row["met"] == "yes" else "none", 8 if marker != "*" else 11
            axes.plot(cost(row), error(row), marker, mfc=face, mec=colour, ms=size, mew=1.5)
        if joined and own:
            groups = sorted(grouped(own, "tolerance").items(), key=lambda one: float(one[0][0]))
            line = [(middle(map(cost, some)), middle(map(error, some))) for _, some in groups]
            axes.plot(*np.array(line).T, color=colour, lw=1.2)
    plain_numbers(axes.xaxis)
    if joined:
        real = [(cost(row), error(row)) for row in rows if row["method"] != ORACLE]
        front = np.array(pareto_front(real)).reshape(-1, 2)
        axes.plot(*front.T, color="black", lw=1.0, ls="--", zorder=1)


def overview_picture(rows: list[Row]):
    """What methods took over ours to meet a tolerance: a point a run that both met, and the median
    as a bar."""
    drawn = styles(rows)
    methods = [m for m in drawn if m not in (OURS, *OTHERS) and pairs(rows, m, COSTS["touches"])]
    names = ("touches", "length", "length to 99 %")
    figure = canvas(13.0, 1.8 + 0.5 * len(methods))
    for axes, name in zip(figure.subplots(1, len(names), sharey=True), names, strict=True):
        axes.set(xscale="log", xlabel=f"{name}, of the method over ours")
        axes.axvline(1.0, color=STYLES[OURS][0], lw=1.5)
        for height, method in enumerate(methods[::-1]):
            ratios = [other / ours for ours, other in pairs(rows, method, COSTS[name])]
            known = [ratio for ratio in ratios if math.isfinite(ratio)]
            colour, marker = drawn[method]
            axes.plot(known, [height] * len(known), marker, color=colour, alpha=0.6, ls="none")
            if known:
                axes.plot([np.median(known)] * 2, [height - 0.35, height + 0.35], "k", lw=2)
        axes.set_yticks(range(len(methods)), methods[::-1])
        plain_numbers(axes.xaxis)
        axes.grid(alpha=0.25, axis="x", which="both")
    figure.suptitle("cost of a met tolerance over that of ours: right of the line, ours is cheaper")
    return figure


ECONOMY = Chart(
    Study("atlas", COLUMNS, measure_run, "ended", {"met": "no"}),
    *(cells_of, summary, pictures, table, 1),
    words=("exploring", "runs"),
)
