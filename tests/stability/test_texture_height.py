"""Waves shorter than the patch can follow."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "texture_height"
SEVERITIES = FAMILIES[FAMILY].severities


def test_waves_of_two_noises_are_noise():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_waves_of_ten_noises_are_seen():
    assert outcomes(FAMILY, SEVERITIES[5:]) == {Outcome.FLAGGED}
