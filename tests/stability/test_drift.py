"""Contours that drift."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "drift"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_drift_of_two_noises_is_borne():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_a_drift_of_eight_is_seen_or_within_the_deviations():
    found = outcomes(FAMILY, SEVERITIES[5:])
    assert Outcome.FLAGGED in found and found <= {Outcome.GOOD, Outcome.FLAGGED}
