"""Corners of three faces."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "corner"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_corner_at_the_rim_does_no_harm():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_a_corner_inside_is_seen():
    assert outcomes(FAMILY, SEVERITIES[2:]) <= GIVEN_OR_REFUSED
