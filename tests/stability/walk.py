"""A small sample of a family: what becomes of its cases."""

from functools import cache

import numpy as np

from tests.kept import kept_once
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.methods import METHODS
from touchatlas.sim.study.stability.outcome import Outcome, Verdict, verdict

GIVEN_OR_REFUSED = {Outcome.GOOD, Outcome.FLAGGED, Outcome.REFUSED}
# Cases of each severity; the full sweep has 25.
_DRAWS = 2


@cache
def verdicts(family: str, method: str = "map", draws: int = _DRAWS) -> dict[float, list[Verdict]]:
    """The verdicts of each severity: those of the first cases of the sweep with seed 0."""
    return {severity: found[:draws] for severity, found in _verdicts(family, method).items()}


@kept_once
def _verdicts(family: str, method: str) -> dict[float, list[Verdict]]:
    cases, found = FAMILIES[family], {}
    for place, severity in enumerate(cases.severities):
        rngs = [np.random.default_rng([0, *family.encode(), place, d]) for d in range(_DRAWS)]
        found[severity] = [verdict(METHODS[method], cases.draw(severity, rng)) for rng in rngs]
    return found


def outcomes(family: str, severities, method: str = "map") -> set[Outcome]:
    """What becomes of the cases of some severities."""
    found = verdicts(family, method)
    return {v.outcome for severity in severities for v in found[severity]}
