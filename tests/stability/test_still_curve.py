"""A probe that did not move."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "still_curve"
SEVERITIES = FAMILIES[FAMILY].severities


def test_three_curves_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:1]) == {Outcome.GOOD}


def test_noise_alone_is_refused():
    assert outcomes(FAMILY, SEVERITIES[1:]) == {Outcome.REFUSED}
