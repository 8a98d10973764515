"""More or fewer curves."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "few_curves"
SEVERITIES = FAMILIES[FAMILY].severities


def test_three_curves_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:6]) == {Outcome.GOOD}


def test_two_curves_are_refused():
    assert outcomes(FAMILY, SEVERITIES[6:]) == {Outcome.REFUSED}
