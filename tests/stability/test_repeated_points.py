"""Samples that repeat the one before."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "repeated_points"
SEVERITIES = FAMILIES[FAMILY].severities


def test_two_of_five_samples_may_repeat():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_too_few_samples_are_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[4:]) <= GIVEN_OR_REFUSED
