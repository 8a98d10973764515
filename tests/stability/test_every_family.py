"""One case of every severity of every family of one patch: the small sample of each run."""

import numpy as np
import pytest

from tests.stability.walk import GIVEN_OR_REFUSED, verdicts
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.methods import METHODS
from touchatlas.sim.study.stability.outcome import Outcome, verdict

# Cases of this sample that are silently wrong. The full sweep is in docs/stability.md.
WRONG = {
    "monkey_saddle": 1,
    "unseen_cubic": 2,
    "torus": 1,
    "step": 1,
    "radius": 1,
    "contradiction": 1,
    "uneven_noise": 1,
}


@pytest.mark.parametrize("family", FAMILIES)
def test_no_more_cases_are_silently_wrong_than_are_known_to_be(family):
    found = verdicts(family)
    assert {v.outcome for v in found} <= GIVEN_OR_REFUSED | {Outcome.WRONG}
    given = [v for v in found if v.outcome is not Outcome.REFUSED]
    assert np.isfinite([(v.error, *v.ratios, v.held, v.claim) for v in given]).all()
    assert sum(v.outcome is Outcome.WRONG for v in given) <= WRONG.get(family, 0)


@pytest.mark.slow
@pytest.mark.parametrize("method", [m for m in METHODS if m != "map"])
@pytest.mark.parametrize("family", FAMILIES)
def test_other_methods_answer_or_refuse_the_easiest_and_the_hardest_case(family, method):
    cases = FAMILIES[family]
    for severity in (cases.severities[0], cases.severities[-1]):
        case = cases.draw(severity, np.random.default_rng(0))
        assert verdict(METHODS[method], case).outcome is not Outcome.CRASHED
