"""Bad contacts, all to one side."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "bad_contacts"
SEVERITIES = FAMILIES[FAMILY].severities


def test_one_in_ten_is_left_out():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_four_in_ten_are_flagged():
    assert outcomes(FAMILY, SEVERITIES[6:]) == {Outcome.FLAGGED}
