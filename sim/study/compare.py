"""Statistics of a study: medians and shares with intervals, and paired tests against a baseline."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binom, binomtest, wilcoxon

from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.tables import grouped, number

# Of a run: what is compared, by its name, and a function of a row. Less is better.
COSTS = {
    "touches": lambda row: number(row["touches"]),
    "machine seconds": lambda row: number(row["machine_seconds"]),
    "touches to 99 %": lambda row: number(row["touches_to_99"]),
    "machine seconds to 99 %": lambda row: number(row["machine_seconds_to_99"]),
    "95 % error / tolerance": lambda row: (
        number(row["completeness_p95"]) / number(row["tolerance_used"])
    ),
    "processor seconds": lambda row: number(row["seconds"]),
}


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float, float]:
    """Median of the finite values, and an interval that holds that of the population.

    Between the k-th smallest and the k-th largest value lies the population's median with the
    probability 1 - 2 P(X < k), X binomial of n and 1/2 (Conover, Practical nonparametric
    statistics, section 3.2). NaN where no k has the level: of fewer than six values at 0.95.

    Examples
    --------
    >>> median_interval(range(1, 11))
    (5.5, 2.0, 9.0)
    """
    known = np.sort([value for value in values if math.isfinite(value)])
    if not len(known):
        return math.nan, math.nan, math.nan
    middle = float(np.median(known))
    k = int(binom.ppf((1.0 - level) / 2.0, len(known), 0.5))
    if k < 1 or 2.0 * binom.cdf(k - 1, len(known), 0.5) > 1.0 - level:
        return middle, math.nan, math.nan
    return middle, float(known[k - 1]), float(known[-k])


def share_interval(count: int, total: int, level: float = 0.95) -> tuple[float, float, float]:
    """Share, and the interval of Wilson (Probable inference, 1927).

    Examples
    --------
    >>> [round(x, 3) for x in share_interval(10, 10)]
    [1.0, 0.722, 1.0]
    """
    found = binomtest(count, total).proportion_ci(level, method="wilson")
    return count / total, float(found.low), float(found.high)


@dataclass(frozen=True)
class Comparison:
    """One value of a flag against the baseline, over runs that are equal in all else.

    Parameters
    ----------
    value : str
    cost : str
        One of ``COSTS``.
    pairs, less, more : int
        Runs that both met, and those where the cost is less or more than the baseline's.
    ratio, low, high : float
        Median of the cost over the baseline's, with its interval.
    p : float
        Of Wilcoxon's signed ranks of the logarithms of the ratios, two-sided, times the number of
        values that are left by Holm's order; NaN without a pair that differs.
    """

    value: str
    cost: str
    pairs: int
    less: int
    more: int
    ratio: float
    low: float
    high: float
    p: float


Pairs = list[tuple[Row, Row]]


def paired(rows: list[Row], flags: Sequence[str], baseline: dict[str, str]) -> dict[str, Pairs]:
    """Rows of every other combination of values of the baseline's flags, each with the baseline's
    row of same object, seed and other ``flags``."""
    same = ("object", "seed", *(flag for flag in flags if flag not in baseline))
    groups = grouped(rows, *baseline)
    theirs = groups.pop(tuple(baseline.values()), [])
    base = {tuple(row[name] for name in same): row for row in theirs}
    return {
        ", ".join(key): [(r, base[at]) for r in own if (at := tuple(r[n] for n in same)) in base]
        for key, own in groups.items()
    }


def both_met(pairs: Pairs) -> Pairs:
    """The pairs of which both met the tolerance."""
    return [pair for pair in pairs if pair[0]["met"] == pair[1]["met"] == "1"]


def comparisons(rows: list[Row], flags: Sequence[str], baseline: dict[str, str]):
    """Every other combination of values of the baseline's flags against it, cost by cost.

    Runs are pairs where object, seed and all other ``flags`` are the same.

    Returns
    -------
    list of Comparison
    list of tuple
        Value, pairs, pairs that only it met, that only the baseline met, and p of McNemar's exact
        test.
    """
    found, met = [], []
    for value, both in paired(rows, flags, baseline).items():
        only = sum(row["met"] == "1" and other["met"] != "1" for row, other in both)
        lost = sum(row["met"] != "1" and other["met"] == "1" for row, other in both)
        p = binomtest(only, only + lost).pvalue if only + lost else math.nan
        met.append((value, len(both), only, lost, float(p)))
        found += [_compared(value, name, both_met(both)) for name in COSTS]
    return [_holm(one, found) for one in found], met


def _compared(value: str, name: str, pairs: Pairs) -> Comparison:
    cost = COSTS[name]
    ratios = np.array([cost(row) / cost(other) for row, other in pairs if cost(other) > 0.0])
    ratios = ratios[np.isfinite(ratios) & (ratios > 0.0)]
    logs = np.log(ratios)
    p = float(wilcoxon(logs).pvalue) if (logs != 0.0).any() else math.nan
    less, more = int((ratios < 1.0).sum()), int((ratios > 1.0).sum())
    return Comparison(value, name, len(ratios), less, more, *median_interval(list(ratios)), p)


def _holm(one: Comparison, every: list[Comparison]) -> Comparison:
    """A comparison with the p of Holm (A simple sequentially rejective multiple test, 1979) among
    those of its cost."""
    ps = sorted(c.p for c in every if c.cost == one.cost and not math.isnan(c.p))
    if math.isnan(one.p):
        return one
    steps = [min(1.0, (len(ps) - k) * p) for k, p in enumerate(ps) if p <= one.p]
    return replace(one, p=max(steps))


def gap_closed(
    rows: list[Row],
    same: Sequence[str],
    column: str,
    value: str,
    cost: Callable[[Row], float],
    ends: tuple[str, str] = ("random", "oracle"),
) -> list[float]:
    """Shares of the gap between two values of a column that a third one closes: 0 as the first, 1
    as the second; of each group of rows with the ``same`` columns that all three met.

    Examples
    --------
    >>> costs = {"random": "9", "oracle": "5", "ours": "6"}
    >>> rows = [{"planner": p, "n": n, "met": "1"} for p, n in costs.items()]
    >>> gap_closed(rows, (), "planner", "ours", lambda row: float(row["n"]))
    [0.75]
    """
    found = []
    for own in grouped([r for r in rows if r["met"] in ("1", "yes")], *same).values():
        costs = {row[column]: cost(row) for row in own}
        if not {*ends, value} <= {*costs}:
            continue
        most, least = (costs[end] for end in ends)
        if most > least:
            found.append((most - costs[value]) / (most - least))
    return found
