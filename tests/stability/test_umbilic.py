"""Points where both curvatures are equal, or nearly so."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "umbilic"
SEVERITIES = FAMILIES[FAMILY].severities


def test_directions_need_not_be_known():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
