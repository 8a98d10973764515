"""One curve of another unit."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "other_unit"
SEVERITIES = FAMILIES[FAMILY].severities


def test_a_unit_off_by_a_hundredth_is_within_the_deviations():
    assert outcomes(FAMILY, SEVERITIES[:3]) == {Outcome.GOOD}


def test_tenfold_units_are_seen():
    assert outcomes(FAMILY, SEVERITIES[5:]) == {Outcome.FLAGGED}
