"""The way on which the simulated probe came, as a touch tells it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.patch import SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason
from touchatlas.sim import Probe, make_object
from touchatlas.sim.world.mesh_object import MeshObject

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


def around(points, half):
    """(n,) where points lie along the outline of a rectangle of half sides, from a corner on, over
    its length."""
    a, b = half
    x, y = points[:, 0], points[:, 1]
    sides = [np.abs(x - a), np.abs(y - b), np.abs(x + a), np.abs(y + b)]
    along = [y + b, 2.0 * b + a - x, 2.0 * (a + b) + b - y, 2.0 * (a + 2.0 * b) + a + x]
    on = np.argmin(sides, axis=0)
    return np.choose(on, along) / (4.0 * (a + b))


@pytest.mark.parametrize("half", [(0.5, 0.5), (0.5, 10.0)], ids=["pin", "wall"])
@pytest.mark.parametrize("step", [0.5, 0.6, 0.8, 1.5, 2.5])
@pytest.mark.parametrize("turn", [2.0 * np.pi / 3.0, np.pi])
def test_a_contour_about_a_thin_body_follows_its_outline(half, step, turn):
    """Steps of half the thickness and more: each sample lies further along the outline than the
    one before, by less than half of it."""
    mesh = trimesh.creation.box((2.0 * half[0], 2.0 * half[1], 30.0))
    obj = MeshObject("thin", mesh.vertices, mesh.faces)
    across, rng = np.linspace(-0.9, 0.9, 7) * half[1], np.random.default_rng(0)
    for y in across:
        place, normal = np.array([half[0], y, 3.0]), np.eye(3)[0]
        plane = SamplingPlane(place, np.eye(3)[2])
        plan = ProbePlan(0, place, normal, (plane,), 10.0 * step, step, turn, Reason.START)
        points = Probe(obj, 0.0, rng)(plan).contours[0].points
        assert len(points) >= 3
        along = np.diff(around(points, half))
        along -= np.round(along)
        assert (along > 0.0).all() or (along < 0.0).all()
        Probe(obj, 0.02, rng)(plan)


def test_a_pin_of_no_width_for_the_step_has_a_contact_and_no_contour():
    mesh = trimesh.creation.box((0.01, 0.01, 30.0))
    obj = MeshObject("needle", mesh.vertices, mesh.faces)
    place = np.array([0.005, 0.0, 3.0])
    plane = SamplingPlane(place, np.eye(3)[2])
    plan = ProbePlan(0, place, np.eye(3)[0], (plane,), 40.0, 2.5, np.pi, Reason.START)
    found = Probe(obj, 0.0, np.random.default_rng(0))(plan)
    assert found.status is TouchStatus.TOUCHED and found.contact == pytest.approx(place)
    assert len(found.contours[0].points) < 5
