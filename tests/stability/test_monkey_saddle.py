"""Monkey saddles: the curves see a part of the cubic only."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "monkey_saddle"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_cubic_of_three_hundredths_is_held():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}
