"""One row a method: how many runs met the tolerance, and what they took against ours."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from touchatlas.sim.study.economy.sweep import Row
from touchatlas.sim.study.economy.trial import ORACLE, OURS

# The planner that the oracle is compared with, for the gap between them.
_RANDOM = "random"
# What a run took: to its own end, and until 99 % of the truth was first within the tolerance.
COSTS: dict[str, Callable[[Row], float]] = {
    "touches": lambda row: float(row["touches"]),
    "tracked": lambda row: float(row["tracked"]),
    "length": lambda row: float(row["tracked"]) + float(row["travel"]),
    "seconds": lambda row: float(row["seconds"]),
    "touches to 99 %": lambda row: number(row["touches_to_99"]),
    "length to 99 %": lambda row: number(row["length_to_99"]),
}


def number(text: str) -> float:
    """The number of a cell; NaN where it is blank."""
    return float(text) if text else float("nan")


def summary(rows: list[Row]) -> list[dict[str, Any]]:
    """One row a method: ``method``, ``runs``, ``met``, and for each of the ``COSTS`` the median of
    ours over its own, over the runs of same object, tolerance and seed that both met; NaN where
    there is none."""
    found: list[dict[str, Any]] = []
    for method in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == method]
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


def gap_closed(rows: list[Row], cost: Callable[[Row], float]) -> float:
    """Median share of the gap between random and oracle that ours closes: 0 as random, 1 as the
    oracle; over the runs that all three met. NaN where there is none.

    Parameters
    ----------
    rows : list of dict
    cost : callable
        One of ``COSTS``.
    """
    ours, random, oracle = (_met(rows, name) for name in (OURS, _RANDOM, ORACLE))
    closed = []
    for key in ours.keys() & random.keys() & oracle.keys():
        most, least = cost(random[key]), cost(oracle[key])
        if most > least:
            closed.append((most - cost(ours[key])) / (most - least))
    return middle(closed)


def middle(values: Iterable[float]) -> float:
    """Median of the values that are known; NaN where there is none."""
    known = [value for value in values if np.isfinite(value)]
    return float(np.median(known)) if known else float("nan")


def _met(rows: list[Row], method: str) -> dict[tuple[str, ...], Row]:
    """The runs of a method that met the tolerance, by object, tolerance and seed."""
    own = [row for row in rows if row["method"] == method and row["met"] == "yes"]
    return {tuple(row[name] for name in ("object", "tolerance", "seed")): row for row in own}
