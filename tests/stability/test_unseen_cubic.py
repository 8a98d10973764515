"""A cubic that no curve sees."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "unseen_cubic"
SEVERITIES = FAMILIES[FAMILY].severities


def test_an_unseen_cubic_of_a_hundredth_is_held():
    assert outcomes(FAMILY, SEVERITIES[:4]) == {Outcome.GOOD}
