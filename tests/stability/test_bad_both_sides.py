"""Bad contacts to both sides."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "bad_both_sides"
SEVERITIES = FAMILIES[FAMILY].severities


def test_one_in_twenty_is_left_out():
    assert outcomes(FAMILY, SEVERITIES[:2]) == {Outcome.GOOD}


def test_four_in_ten_are_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[2:]) <= GIVEN_OR_REFUSED
