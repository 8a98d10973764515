"""Planes, and surfaces that are nearly planes."""

from tests.stability.walk import nothing_crashes, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "plane"
SEVERITIES = FAMILIES[FAMILY].severities


def test_both_curvatures_may_vanish():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}


def test_nothing_crashes():
    assert nothing_crashes(FAMILY)
