"""K that changes its sign across the patch."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "changing_sign"
SEVERITIES = FAMILIES[FAMILY].severities


def test_k_may_change_its_sign():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
