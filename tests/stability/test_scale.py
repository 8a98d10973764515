"""All units of length."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "scale"
SEVERITIES = FAMILIES[FAMILY].severities


def test_no_unit_is_special():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
