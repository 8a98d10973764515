"""Planes that are nearly parallel."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "parallel_planes"
SEVERITIES = FAMILIES[FAMILY].severities


def test_five_degrees_apart_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_two_degrees_and_less_are_refused():
    assert outcomes(FAMILY, SEVERITIES[4:]) == {Outcome.REFUSED}
