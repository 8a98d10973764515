"""A curve that lies beside the others."""

from tests.stability.walk import outcomes
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.outcome import Outcome

FAMILY = "contradiction"
SEVERITIES = FAMILIES[FAMILY].severities


def test_one_noise_beside_is_borne():
    assert outcomes(FAMILY, SEVERITIES[:3]) == {Outcome.GOOD}


def test_thirty_noises_beside_are_seen():
    assert outcomes(FAMILY, SEVERITIES[6:]) == {Outcome.FLAGGED}
