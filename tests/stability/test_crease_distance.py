"""Curves that run over an edge of 60 degrees."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "crease_distance"
SEVERITIES = FAMILIES[FAMILY].severities


def test_an_edge_at_the_rim_does_no_harm():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_an_edge_inside_is_seen():
    assert outcomes(FAMILY, SEVERITIES[2:]) <= GIVEN_OR_REFUSED
