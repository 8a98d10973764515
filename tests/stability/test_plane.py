"""Planes, and surfaces that are nearly planes."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "plane"
SEVERITIES = FAMILIES[FAMILY].severities


def test_both_curvatures_may_vanish():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
