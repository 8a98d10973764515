"""All numbers of the paper's experiments, on stand-ins for its objects.

Every number is over fresh draws of the noise alone: reference points and planes stay.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchatlas.sim.study.fits import PAPER_MULTIPLIER
from touchatlas.sim.study.paper.curvatures import ellipsoid, sphere
from touchatlas.sim.study.paper.fits import (
    CURVES,
    DATA,
    DESCENT,
    FAST,
    OTHERS,
    OURS,
    PLAIN,
    data_points,
    judged,
    spreads,
    verifying_points,
)
from touchatlas.sim.study.paper.gauss_maps import gauss_maps
from touchatlas.sim.study.paper.scenes import NOISE, neck, plan_at, touches
from touchatlas.sim.study.study import check_options

# The paper does not say how far its patches reach. Long arms may turn by so much.
REACHES, _WIDE_TURN = (8.0, 12.0, 16.0, 20.0), 0.5 * np.pi


@dataclass(frozen=True)
class Row:
    """One row of table 1.

    Parameters
    ----------
    fit : str
        One of ``touchatlas.sim.study.paper.fits.FITS``.
    curves : tuple of int
        Of the twelve, those that are fitted.
    paper : dict
        The paper's own figures; empty where it has none.
    """

    fit: str
    curves: tuple[int, ...]
    paper: dict[str, float]


ROWS = (
    Row(PLAIN, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0459, "verifying": 11.8753}),
    Row(DESCENT, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0646, "verifying": 0.0681}),
    Row(DESCENT, OTHERS, {"k1": 0.019, "k2": -0.0453, "data": 0.0811, "verifying": 0.1531}),
    Row(FAST, DATA, {}),
    Row(OURS, DATA, {}),
)


def table1(draws: int, rng: np.random.Generator) -> dict:
    """The paper's table 1 in the bottle's neck."""
    place = neck()
    plan = plan_at(place, CURVES)
    visits = list(touches(place, plan, draws, rng))
    rows = [
        {
            "fit": row.fit,
            "curves": "three" if row.curves == DATA else "three of the nine",
            "data_points": len(data_points(visits[0], row.curves)),
            "verifying_points": len(verifying_points(visits[0], row.curves)),
            **spreads([judged(row.fit, touch, row.curves) for touch in visits]),
            "paper": row.paper,
        }
        for row in ROWS
    ]
    exact = {"k1": place.k1, "k2": place.k2}
    return {"arm_length": plan.reach, "exact": exact, "rows": rows}


def reaches(draws: int, rng: np.random.Generator) -> list[dict]:
    """Errors in the neck for arms of several lengths."""
    place, found = neck(), []
    for reach in REACHES:
        plan = plan_at(place, CURVES, reach=reach, turn=_WIDE_TURN)
        visits = list(touches(place, plan, draws, rng))
        for fit in (PLAIN, DESCENT, OURS):
            measures = spreads([judged(fit, touch) for touch in visits])
            errors = {name: measures[name] for name in ("data", "verifying", "inside")}
            found.append({"arm_length": reach, "fit": fit, **errors})
    return found


TABLES: dict[str, Callable] = {
    "table1": table1,
    "reaches": reaches,
    "gauss_map": gauss_maps,
    "ellipsoid": ellipsoid,
    "sphere": sphere,
}


def paper_tables(
    draws: int = 50,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> dict:
    """All numbers, ready for JSON.

    Parameters
    ----------
    draws : int
        Of the noise, for every number.
    seed : int
        Each table has a stream of its own.
    watch : callable
        Called with the number of tables done and of all, for progress.

    Returns
    -------
    dict
        ``TABLES`` by name, every measured value as its ``spread``, with the paper's figures in
        the project's signs: convex is negative. Lengths in millimetres, areas in steradian.

    Raises
    ------
    ValueError
        No draw, or a negative seed.
    """
    check_options(draws, seed)
    found: dict = {"draws": draws, "seed": seed, "noise_std": NOISE, "multiplier": PAPER_MULTIPLIER}
    streams = np.random.default_rng(seed).spawn(len(TABLES))
    for done, ((name, table), rng) in enumerate(zip(TABLES.items(), streams, strict=True)):
        found[name] = table(draws, rng)
        watch(done + 1, len(TABLES))
    return found
