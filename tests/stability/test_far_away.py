"""Touches far from the origin of the coordinates."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "far_away"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_million_reaches_away_is_as_near_as_none():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
