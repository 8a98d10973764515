"""Edges of all angles at 0.4 of the reach."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "crease_angle"
SEVERITIES = FAMILIES[FAMILY].severities


def test_an_edge_of_a_degree_is_within_the_noise():
    assert outcomes(FAMILY, SEVERITIES[:3]) == {Outcome.GOOD}


def test_a_sharp_edge_is_seen():
    assert outcomes(FAMILY, SEVERITIES[5:]) <= GIVEN_OR_REFUSED
