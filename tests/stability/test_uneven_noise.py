"""One curve of more noise than the others."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "uneven_noise"
SEVERITIES = FAMILIES[FAMILY].severities


def test_four_times_the_noise_is_weighed():
    assert outcomes(FAMILY, SEVERITIES[:3]) == {Outcome.GOOD}
