"""Contacts without noise."""

from tests.stability.walk import GIVEN_OR_REFUSED, outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "exact"
SEVERITIES = FAMILIES[FAMILY].severities


def test_exact_contacts_are_not_trusted_between_the_curves():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_strong_curvature_is_never_silently_wrong():
    assert outcomes(FAMILY, SEVERITIES[4:]) <= GIVEN_OR_REFUSED
