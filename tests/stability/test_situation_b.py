"""Two curves nearly in one direction: the paper's situation (b)."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "situation_b"
SEVERITIES = FAMILIES[FAMILY].severities


def test_ten_degrees_apart_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_one_degree_is_no_more_than_flagged():
    assert outcomes(FAMILY, SEVERITIES[5:]) <= GIVEN_OR_REFUSED


def test_one_plane_twice_is_refused():
    assert outcomes(FAMILY, SEVERITIES[7:]) == {Outcome.REFUSED}
