"""One curve of another frame."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "other_frame"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_frame_off_by_0_3_degrees_is_within_the_deviations():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}


def test_ten_degrees_are_seen():
    assert outcomes(FAMILY, SEVERITIES[6:]) == {Outcome.FLAGGED}
