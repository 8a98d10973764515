"""One curve that was tracked in another plane than stated."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "wrong_plane"
SEVERITIES = FAMILIES[FAMILY].severities


def test_three_degrees_do_no_harm():
    assert outcomes(FAMILY, SEVERITIES[:5]) == {Outcome.GOOD}


def test_twenty_degrees_are_seen():
    assert outcomes(FAMILY, SEVERITIES[6:]) == {Outcome.FLAGGED}
