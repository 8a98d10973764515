"""One curve that is shorter than the others."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "short_curve"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_curve_may_have_half_the_length():
    assert outcomes(FAMILY, SEVERITIES[:1]) == {Outcome.GOOD}


def test_a_curve_of_three_samples_is_refused():
    assert outcomes(FAMILY, SEVERITIES[5:]) == {Outcome.REFUSED}
