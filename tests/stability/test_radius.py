"""Touches that reach over more than one feature."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "radius"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_reach_of_0_7_features_is_good():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}
