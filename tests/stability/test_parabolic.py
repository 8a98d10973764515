"""Points where one curvature is zero, or nearly so."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "parabolic"
SEVERITIES = FAMILIES[FAMILY].severities


def test_one_curvature_may_vanish():
    assert outcomes(FAMILY, SEVERITIES) == {Outcome.GOOD}
