"""The way on which the simulated probe came, as a touch tells it."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.planner import Planner
from touchatlas.sim import Probe, make_object

BALL = make_object("sphere")
PLAN = replace(Planner(*BALL.start()).ask(Atlas(0.5)), approach=2.0)


def touch(plan, noise: float = 0.0):
    return Probe(BALL, noise, np.random.default_rng(0))(plan)


def test_the_way_of_a_touch_leads_from_where_the_probe_began_to_its_contact():
    found = touch(PLAN)
    assert found.way[0] == pytest.approx(PLAN.reference_point + 2.0 * PLAN.normal)
    assert found.way[1] == pytest.approx(found.contact, abs=1e-9)
    noisy = touch(PLAN, 0.1)
    assert (noisy.way[1] - noisy.contact) @ PLAN.normal == pytest.approx(0.0, abs=1e-12)


def test_the_way_of_an_approach_in_vain_passes_the_place_that_was_planned():
    """As far below it as above, or the usual distance, if that is more."""
    aside = replace(PLAN, reference_point=PLAN.reference_point + 40.0 * np.eye(3)[0])
    found = touch(aside)
    assert found.status is TouchStatus.NO_CONTACT
    above, below = (found.way - aside.reference_point) @ PLAN.normal
    assert above == pytest.approx(2.0) and below == pytest.approx(-max(2.0, PLAN.usual_approach))


def test_an_approach_that_would_begin_inside_is_unreachable_and_not_made():
    deep = replace(PLAN, reference_point=PLAN.reference_point - 20.0 * PLAN.normal)
    probe = Probe(BALL, 0.0, np.random.default_rng(0))
    probe(PLAN)
    before = probe.state()
    found = probe(deep)
    assert found.status is TouchStatus.UNREACHABLE and found.way is None
    assert found.travel_length == 0.0 and probe.state() == before


def test_a_contact_that_noise_places_above_the_beginning_has_no_way():
    rng = np.random.default_rng(0)
    ways = [Probe(BALL, 0.1, rng)(replace(PLAN, approach=1e-3)).way for _ in range(20)]
    assert 5 < sum(way is None for way in ways) < 15


def test_a_state_that_is_none_is_refused():
    with pytest.raises(ValueError, match="the probe's state cannot be read"):
        Probe(BALL, 0.1, np.random.default_rng(0)).restore("{}")
