"""Curves that do not meet in the reference point."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "missing_point"
SEVERITIES = FAMILIES[FAMILY].severities


def test_curves_may_miss_the_point():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
