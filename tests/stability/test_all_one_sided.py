"""A reference point at the rim of what was touched."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "all_one_sided"
SEVERITIES = FAMILIES[FAMILY].severities


def test_the_point_may_lie_near_the_rim():
    assert outcomes(FAMILY, SEVERITIES[:6]) == {Outcome.GOOD}


def test_a_point_on_the_rim_is_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[6:]) <= GIVEN_OR_REFUSED
