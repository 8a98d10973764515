"""Sampling planes that lean from the normal."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "grazing"
SEVERITIES = FAMILIES[FAMILY].severities


def test_eighty_degrees_are_good():
    assert outcomes(FAMILY, SEVERITIES[:6]) == {Outcome.GOOD}


def test_grazing_planes_are_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[6:]) <= GIVEN_OR_REFUSED
