"""The rows of a sweep summed up: shares of outcomes, typical errors, what intervals hold."""

from collections import Counter

import numpy as np

from touchatlas.sim.study.stability.outcome import Outcome

GIVEN = (Outcome.GOOD.value, Outcome.FLAGGED.value)


def shares(rows: list[dict[str, str]]) -> dict[str, float]:
    """Fraction of each outcome, and of the good ones that are doubted.

    >>> shares([{"outcome": "good", "doubts": ""}, {"outcome": "wrong", "doubts": ""}])["wrong"]
    0.5
    """
    count = Counter(row["outcome"] for row in rows)
    doubted = sum(row["outcome"] == Outcome.GOOD.value and bool(row["doubts"]) for row in rows)
    found = {outcome.value: count[outcome.value] / len(rows) for outcome in Outcome}
    return found | {"good but doubted": doubted / len(rows)}


def median_error(rows: list[dict[str, str]]) -> float:
    """Median error in noises of the cases with an answer; NaN where there is none."""
    errors = [float(row["error"]) for row in rows]
    known = [error for error in errors if not np.isnan(error)]
    return float(np.median(known)) if known else np.nan


def within_three_noises(rows: list[dict[str, str]]) -> float:
    """Fraction of the cases whose heights err by three noises at most; refusals do not."""
    return float(np.mean([float(row["error"]) <= 3.0 for row in rows]))


def held(rows: list[dict[str, str]]) -> float:
    """Fraction of true points within 1.96 deviations, over good and flagged cases."""
    values = [float(row["held"]) for row in rows if row["outcome"] in GIVEN]
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else np.nan


def summary(rows: list[dict[str, str]]) -> list[dict[str, str | float]]:
    """One row a family and method, and one a method over all families, called "all"."""
    families = [*dict.fromkeys(row["family"] for row in rows), "all"]
    found: list[dict[str, str | float]] = []
    for method in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == method]
        for family in families:
            part = own if family == "all" else [row for row in own if row["family"] == family]
            row: dict[str, str | float] = {"family": family, "method": method, "cases": len(part)}
            row |= shares(part)
            row |= {"error": median_error(part), "three noises": within_three_noises(part)}
            found.append(row | {"held": held(part)})
    return found
