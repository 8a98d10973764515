"""Contours of few samples."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "few_points"
SEVERITIES = FAMILIES[FAMILY].severities


def test_nine_samples_are_enough():
    assert outcomes(FAMILY, SEVERITIES[:5]) == {Outcome.GOOD}


def test_four_samples_are_refused():
    assert outcomes(FAMILY, SEVERITIES[7:]) == {Outcome.REFUSED}
