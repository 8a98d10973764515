"""One arm that is shorter than all others."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "one_sided"
SEVERITIES = FAMILIES[FAMILY].severities


def test_one_arm_may_be_a_tenth():
    assert outcomes(FAMILY, SEVERITIES[:6]) == {Outcome.GOOD}


def test_an_arm_that_is_missing_is_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[6:]) <= GIVEN_OR_REFUSED
