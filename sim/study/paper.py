"""All numbers of the paper's experiments, on stand-ins for its objects.

Every number is over fresh draws of the noise alone: reference points and planes stay.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchatlas.patch.paper.curvature_on_grid import convex_hull
from touchatlas.patch.paper.total_curvature import objective
from touchatlas.sim.study.cells import DONE, Cell, Ledger
from touchatlas.sim.study.fits import PAPER_MULTIPLIER, height_error
from touchatlas.sim.study.paper_places import (
    CURVES,
    DATA,
    DESCENT,
    FAST,
    NOISE,
    OURS,
    PLAIN,
    Visit,
    place,
    quadrant,
    section_curvatures,
    true_areas,
)
from touchatlas.sim.study.study import Watch, check_options, measure_cells
from touchatlas.sim.study.workers import WorkOptions


def judged(fit: str, visit: Visit) -> dict[str, float]:
    """One draw of one fit.

    Returns
    -------
    dict
        ``k1``, ``k2``; ``data`` and ``verifying``, the means of |z(x_k, y_k) - z_k| on the
        fitted and on all other curves, and ``inside``, on the other curves within the hull D of
        the fitted ones, length; of the paper's fits also ``objective``, (5) over the number of
        points, length^2.
    """
    patch = visit.patch(fit)
    errors = np.abs(height_error(patch, visit.verifying))
    hull = convex_hull(patch.frame.to_local(visit.data)[:, :2]).equations
    flat = patch.frame.to_local(visit.verifying)[:, :2]
    inside = (flat @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1)
    found = {
        "k1": patch.curvatures.k1,
        "k2": patch.curvatures.k2,
        "data": float(np.abs(height_error(patch, visit.data)).mean()),
        "verifying": float(errors.mean()),
        "inside": float(errors[inside].mean()),
    }
    if fit != OURS:
        problem, coefficients = visit.fold(patch)
        found["objective"] = objective(problem, coefficients) / len(problem.target)
    return found


def spread(values) -> dict[str, float | None]:
    """Median, quartiles, mean and standard deviation; None where they are not finite.

    >>> spread([1.0, 2.0, 3.0, 4.0, 5.0])["upper"]
    4.0
    """
    values = np.sort(np.asarray(values, dtype=float))
    # A patch that a height does not meet has an infinite error, and the draws no mean.
    found = {
        "median": _quantile(values, 0.5),
        "lower": _quantile(values, 0.25),
        "upper": _quantile(values, 0.75),
        "mean": values.mean(),
        "std": values.std() if np.isfinite(values).all() else np.inf,
    }
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}


def _quantile(values, fraction: float) -> float:
    """Of sorted values, linear between two of them; infinite where one of the two is."""
    low, part = divmod(fraction * (len(values) - 1), 1.0)
    below, above = values[int(low)], values[int(np.ceil(low + part))]
    return below if part == 0.0 else (1.0 - part) * below + part * above


def spreads(measures: Sequence[dict[str, float]]) -> dict[str, dict]:
    """The spread of each measure over the draws."""
    return {name: spread([found[name] for found in measures]) for name in measures[0]}


@dataclass(frozen=True)
class Row:
    """One row of table 1: a fit, its curves of the twelve, and the paper's own figures, if any."""

    fit: str
    curves: tuple[int, ...]
    paper: dict[str, float]


ROWS = (
    Row(PLAIN, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0459, "verifying": 11.8753}),
    Row(DESCENT, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0646, "verifying": 0.0681}),
    Row(DESCENT, (2, 6, 10), {"k1": 0.019, "k2": -0.0453, "data": 0.0811, "verifying": 0.1531}),
    Row(FAST, DATA, {}),
    Row(OURS, DATA, {}),
)


def table1(draws: int, rng: np.random.Generator) -> dict:
    """The paper's table 1 in the bottle's neck."""
    neck = place("neck")
    plan = neck.plan(CURVES)
    visits = list(neck.visits(plan, draws, rng))
    rows = []
    for row in ROWS:
        own = [Visit(visit.touch, row.curves) for visit in visits]
        rows.append(
            {
                "fit": row.fit,
                "curves": "three" if row.curves == DATA else "three of the nine",
                "data_points": len(own[0].data),
                "verifying_points": len(own[0].verifying),
                **spreads([judged(row.fit, visit) for visit in own]),
                "paper": row.paper,
            }
        )
    return {"arm_length": plan.reach, "exact": {"k1": neck.k1, "k2": neck.k2}, "rows": rows}


def reaches(draws: int, rng: np.random.Generator) -> list[dict]:
    """Errors in the neck for arms of several lengths: the paper does not say how far its reach.
    Long arms may turn by 90 degrees."""
    neck, found = place("neck"), []
    for reach in (8.0, 12.0, 16.0, 20.0):
        visits = list(neck.visits(neck.plan(CURVES, reach=reach, turn=0.5 * np.pi), draws, rng))
        for fit in (PLAIN, DESCENT, OURS):
            measures = spreads([judged(fit, visit) for visit in visits])
            errors = {name: measures[name] for name in ("data", "verifying", "inside")}
            found.append({"arm_length": reach, "fit": fit, **errors})
    return found


def gauss_maps(draws: int, rng: np.random.Generator) -> dict[str, dict]:
    """Algebraic and absolute area of the Gauss map of the neck's patch by (3), by (5) and of the
    object, steradian: the paper's figure 4 in numbers."""
    neck = place("neck")
    found: dict[str, list[dict[str, float]]] = {PLAIN: [], DESCENT: [], "exact": []}
    for visit in neck.visits(neck.plan(3), draws, rng):
        for fit in (PLAIN, DESCENT):
            patch = visit.patch(fit)
            areas = visit.gauss_map(patch)
            found[fit].append({"algebraic": areas.algebraic_area, "absolute": areas.absolute_area})
        # Of both patches the one near to the surface.
        found["exact"].append(true_areas(neck, patch, visit))
    return {name: spreads(measures) for name, measures in found.items()}


def ellipsoid(draws: int, rng: np.random.Generator, points: int = 9) -> list[dict]:
    """k1 and k2 at points along the ellipsoid's quadrant, by both ways, beside the exact ones.

    Each curve has four neighbours of the point on either side. The paper's ellipsoid has no unit:
    it is as large as its robot's accuracy in millimetres, and less.
    """
    found = []
    for noise in (NOISE, 0.1 * NOISE):
        for spot in quadrant(points):
            plan = spot.plan(3, 4)
            visits = list(spot.visits(plan, draws, rng, noise))
            ours = [visit.patch(OURS).curvatures for visit in visits]
            found.append(
                {
                    "noise_std": noise,
                    "point": spot.point.tolist(),
                    "arm_length": plan.reach,
                    "exact": {"k1": spot.k1, "k2": spot.k2},
                    "sections": _pairs([section_curvatures(visit)[1:] for visit in visits]),
                    OURS: _pairs([(known.k1, known.k2) for known in ours]),
                }
            )
    return found


def sphere(draws: int, rng: np.random.Generator) -> dict:
    """Curvatures of the sphere of radius 33 from its sections, and errors of two patches."""
    ball = place("ball")
    plan = ball.plan(CURVES)
    visits = list(ball.visits(plan, draws, rng))
    found = [section_curvatures(visit) for visit in visits]
    return {
        "arm_length": plan.reach,
        "exact": ball.k1,
        "normal_curvatures": [spread(column) for column in np.array([f[0] for f in found]).T],
        **_pairs([f[1:] for f in found]),
        "patches": {
            fit: spreads([judged(fit, visit) for visit in visits]) for fit in (DESCENT, OURS)
        },
        "paper": {"normal_curvatures": [-0.0299, -0.0307, -0.0305], "k1": -0.0299, "k2": -0.0309},
    }


def _pairs(pairs) -> dict[str, dict]:
    return spreads([{"k1": k1, "k2": k2} for k1, k2 in pairs])


TABLES: dict[str, Callable] = {
    "table1": table1,
    "reaches": reaches,
    "gauss_map": gauss_maps,
    "ellipsoid": ellipsoid,
    "sphere": sphere,
}


def measure_table(name: str, draws: int, seed: int) -> list[dict[str, str]]:
    """One of the ``TABLES`` as a row of JSON; each table has a stream of its own of the seed."""
    streams = np.random.default_rng(seed).spawn(len(TABLES))
    numbers = TABLES[name](draws, streams[list(TABLES).index(name)])
    return [{"table": name, "numbers": json.dumps(numbers)}]


def paper_tables(
    folder: Path,
    draws: int = 50,
    seed: int = 0,
    watch: Watch = lambda done, total: None,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
) -> dict:
    """All numbers, ready for JSON; each table is a cell of the folder's ledger.

    Parameters
    ----------
    folder : Path
    draws : int
        Of the noise, for every number.
    seed : int
    watch : callable
        Called with the number of tables done and of all, for progress.
    work : WorkOptions
    say : callable
        Called with sentences for the user.

    Returns
    -------
    dict
        ``TABLES`` by name, every measured value as its ``spread``, with the paper's figures in
        the project's signs: convex is negative. Lengths in millimetres, areas in steradian.

    Raises
    ------
    ValueError
        No draw, or a negative seed.
    RuntimeError
        A table that was not measured.
    """
    check_options(draws, seed)
    found: dict = {"draws": draws, "seed": seed, "noise_std": NOISE, "multiplier": PAPER_MULTIPLIER}
    cells = [Cell("", {}, (name, draws, seed)) for name in TABLES]
    with Ledger(folder) as ledger:
        measure_cells(ledger, measure_table, cells, watch, work, say)
    for name, cell in zip(TABLES, cells, strict=True):
        answer = ledger.answers[cell.key(measure_table)]
        if answer.kind != DONE:
            raise RuntimeError(f"{name}: {answer.words}")
        found[name] = json.loads(answer.rows[0]["numbers"])
    return found
