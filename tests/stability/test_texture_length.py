"""Waves of ten noises, of all lengths."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "texture_length"
SEVERITIES = FAMILIES[FAMILY].severities


def test_waves_of_two_reaches_are_followed():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_waves_of_a_quarter_are_seen():
    assert outcomes(FAMILY, SEVERITIES[4:]) == {Outcome.FLAGGED}
