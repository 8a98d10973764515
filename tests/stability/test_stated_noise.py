"""Noise that is not what the probe states."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "stated_noise"
SEVERITIES = FAMILIES[FAMILY].severities


def test_the_stated_noise_may_be_wrong():
    assert outcomes(FAMILY, SEVERITIES[1:4]) == {Outcome.GOOD}


def test_a_hundredfold_is_never_silently_wrong():
    assert outcomes(FAMILY, (SEVERITIES[0], *SEVERITIES[4:])) <= GIVEN_OR_REFUSED
