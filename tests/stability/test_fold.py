"""Balls whose arms pass the equator."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "fold"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_ball_is_followed_to_80_degrees():
    assert outcomes(FAMILY, SEVERITIES[:5]) == {Outcome.GOOD}


def test_arms_past_the_equator_are_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[5:]) <= GIVEN_OR_REFUSED
