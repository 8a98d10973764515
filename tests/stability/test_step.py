"""A step across the curves."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "step"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_step_of_one_noise_is_noise():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_a_step_of_ten_noises_is_seen():
    assert outcomes(FAMILY, SEVERITIES[4:]) == {Outcome.FLAGGED}
