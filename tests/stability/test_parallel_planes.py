"""Planes that are nearly parallel."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "parallel_planes"
SEVERITIES = FAMILIES[FAMILY].severities


def test_thirty_degrees_apart_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_ten_and_five_degrees_apart_are_given_with_what_is_not_known():
    assert outcomes(FAMILY, SEVERITIES[2:4]) <= {Outcome.GOOD, Outcome.FLAGGED}


def test_two_degrees_and_less_are_refused():
    assert outcomes(FAMILY, SEVERITIES[4:]) == {Outcome.REFUSED}
