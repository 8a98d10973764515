"""What runs took to meet a tolerance, over what ours took."""

import math
from collections.abc import Callable

from rich.box import SIMPLE
from rich.table import Table

from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.compare import gap_closed
from touchatlas.sim.study.tables import Summed, grouped, middle, number

OURS, ORACLE = "tolerance", "oracle"
# Surfaces by others from the touches of our planner, where their package is present.
OTHERS = ("APSS", "RIMLS", "Poisson")

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
