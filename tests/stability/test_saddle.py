"""Saddles of equal and opposite curvatures."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "saddle"
SEVERITIES = FAMILIES[FAMILY].severities


def test_curvatures_may_be_opposite_up_to_half_the_reach_as_their_radius():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
