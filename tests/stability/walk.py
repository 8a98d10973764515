"""A small sample of a family: what becomes of its cases."""

import numpy as np

from tests.kept import kept_once
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.methods import METHODS
from touchatlas.sim.study.stability.outcome import Outcome, Verdict, verdict

GIVEN_OR_REFUSED = {Outcome.GOOD, Outcome.FLAGGED, Outcome.REFUSED}


def verdicts(family: str) -> list[Verdict]:
    """One verdict of each severity: that of the first case of the sweep with seed 0."""
    return [_verdict(family, one, "map", 0) for one in FAMILIES[family].severities]


@kept_once
def _verdict(family: str, severity: float, method: str, draw: int) -> Verdict:
    cases = FAMILIES[family]
    place = cases.severities.index(severity)
    rng = np.random.default_rng([0, *family.encode(), place, draw])
    return verdict(METHODS[method], cases.draw(severity, rng))


def outcomes(family: str, severities, method: str = "map") -> set[Outcome]:
    """What becomes of two cases of some severities; the full sweep has 25."""
    found = [_verdict(family, one, method, draw) for one in severities for draw in (0, 1)]
    return {verdict.outcome for verdict in found}
