"""A torus, whose cubic the curves see in part."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "torus"
SEVERITIES = FAMILIES[FAMILY].severities


def test_arms_as_long_as_the_tube_s_radius_are_held():
    assert outcomes(FAMILY, SEVERITIES[:5]) == {Outcome.GOOD}
