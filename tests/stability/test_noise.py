"""Noise of a hundred thousandth to a tenth of the reach."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "noise"
SEVERITIES = FAMILIES[FAMILY].severities


def test_noise_up_to_a_tenth_of_the_reach_is_borne():
    assert outcomes(FAMILY, SEVERITIES[1:]) == {Outcome.GOOD}
