"""The planner that touches what a tolerance asks for: known at the end, and no more touches."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import Explored, explored, missed
from touchatlas.atlas import Atlas, AtlasChange, TouchStatus, extract_surface
from touchatlas.planner import (
    Planner,
    PlannerOptions,
    Reason,
    StopReason,
    explore,
)
from touchatlas.sim import Probe, make_object


@lru_cache
def known(name: str) -> Explored:
    return explored(name)


def empty(tolerance: float) -> Atlas:
    return Atlas(tolerance, scale=0.1)


def test_a_first_touch_that_meets_nothing_is_tried_elsewhere_and_then_given_up():
    """24 places about the start, no two alike; then the planner says that no touch gave a patch."""
    p, atlas = Planner([0, 0, 33], [0, 0, 1]), empty(0.1)
    steps = list(explore(atlas, p, missed))
    points = np.array([step.plan.reference_point for step in steps])
    assert len(np.unique(points.round(6), axis=0)) == len(points) == 24
    assert len(atlas) == 0 and p.stop.reason is StopReason.NO_PATCH
    # Until there is a patch one plan is pending, however many are wanted.
    assert len(Planner([0, 0, 33], [0, 0, 1]).ask_several(empty(0.1), 2)) == 1


@pytest.mark.parametrize("name", ["sphere", "bottle"])
def test_the_surface_is_known_to_the_tolerance_at_the_end(name):
    """At least as much of it as is predicted, to 0.01: the fraction of 4,000 points within the
    tolerance has a standard error of 0.001, and errors near each other are alike. The surface is
    closed."""
    obj, found = make_object(name), known(name)
    assert found.stop.reason is StopReason.KNOWN
    points, _ = obj.sample(4000, np.random.default_rng(2))
    distance = np.abs(np.nan_to_num(found.atlas.blend(points).distance, nan=np.inf))
    predicted = found.stop.forecast.predicted_coverage
    assert predicted >= PlannerOptions().coverage
    assert (distance <= obj.tolerance).mean() > predicted - 0.01
    found.atlas.validate()
    surface = extract_surface(found.atlas)
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2


def test_a_looser_tolerance_ends_the_same_touches_earlier():
    """Bit for bit: what is learned and where to touch do not depend on the tolerance, but for holes
    that matter to it."""
    fine, obj = known("bottle").touches, make_object("bottle")
    # The arms of the first touch are in scales, which are the tolerance where none is given.
    atlas, p = Atlas(10.0 * obj.tolerance, scale=obj.tolerance), Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(0))
    coarse = [step.touch for step in explore(atlas, p, probe, len(fine))]
    assert p.stop is not None and p.stop.reason is StopReason.KNOWN
    assert 4 < len(coarse) < len(fine)
    for one, other in zip(coarse, fine[: len(coarse)], strict=True):
        assert np.array_equal(one.contact, other.contact)
        assert len(one.contours) == len(other.contours)
        for contour, same in zip(one.contours, other.contours, strict=True):
            assert np.array_equal(contour.points, same.points)


def test_a_place_that_the_probe_missed_is_tried_once_from_what_is_known():
    """The second touch comes to the nearest sample, with a plane through the place."""
    obj = make_object("ellipsoid")
    atlas, p = empty(obj.tolerance), Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    touch = probe(p.ask(atlas))
    p.tell(touch, atlas.add(touch))
    plan = p.ask(atlas)
    assert plan.reason is Reason.EXPAND
    p.tell(missed(plan), AtlasChange(refused="no contact"))
    again = p.ask(atlas)
    away = np.linalg.norm(atlas.pool.points - plan.reference_point, axis=1)
    moved = plan.reference_point - again.reference_point
    assert np.linalg.norm(moved) == pytest.approx(away.min(), rel=1e-12)
    assert abs(moved @ again.planes[0].normal) < 1e-9 * away.min()
    p.tell(missed(again), AtlasChange(refused="no contact"))
    third = p.ask(atlas)
    assert np.linalg.norm(third.reference_point - plan.reference_point) > 1.01 * away.min()


def test_a_start_at_which_touches_teach_nothing_is_left_after_six_of_them():
    """The same place is not met again from deeper below: the seventh touch is 102 scales beside it,
    500 / sqrt(24)."""
    obj = make_object("ellipsoid")
    atlas, p = Atlas(obj.tolerance, scale=0.1), Planner(*obj.start())
    probe, beside = Probe(obj, obj.noise_std, np.random.default_rng(1)), []
    for _ in range(7):
        plan = p.ask(atlas)
        off = plan.reference_point - obj.start()[0]
        beside.append(float(np.linalg.norm(off - (off @ plan.normal) * plan.normal)))
        p.tell(probe(plan), AtlasChange(refused="too few"))
    assert beside == pytest.approx([0.0] * 6 + [50.0 / np.sqrt(24.0)], abs=1e-9)


def planner_that_misses(misses: int):
    """A planner of an ellipsoid after one touch, and so many approaches in vain; with its atlas and
    probe."""
    obj = make_object("ellipsoid")
    atlas, p = empty(obj.tolerance), Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    touch = probe(p.ask(atlas))
    p.tell(touch, atlas.add(touch))
    for _ in range(misses):
        p.tell(missed(p.ask(atlas)), AtlasChange(refused="no contact"))
    return p, atlas, probe


def test_no_plan_is_made_again_however_often_the_probe_misses():
    """Where approaches often miss, places are sought from samples: the place counts as tried, and
    is not chosen again. Two places may have the same nearest sample, but hardly three."""
    p, atlas, _ = planner_that_misses(5)
    points = []
    for _ in range(12):
        plan = p.ask(atlas)
        points.append(tuple(plan.reference_point))
        p.tell(missed(plan), AtlasChange(refused="no contact"))
    assert max(points.count(point) for point in points) <= 3


def test_several_pending_plans_have_planes_of_their_own_after_misses():
    """Those from one sample lead to different places."""
    p, atlas, _ = planner_that_misses(5)
    plans = p.ask_several(atlas, 4)
    ways = {(*plan.reference_point, *plan.planes[0].normal) for plan in plans}
    assert len(plans) == len(ways) == 4


def test_arms_end_where_the_surface_is_known():
    """The last touch, amid others, tracks less than one that may not end so, by a tenth or more."""
    obj = make_object("ellipsoid")
    atlas, p = empty(0.3), Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    last = list(explore(atlas, p, probe))[-1]
    free = probe(replace(last.plan, until=None))
    assert last.touch.tracked_length < 0.9 * free.tracked_length


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"curves": 2}, "curves"),
        ({"curves": 10**6}, "curves"),
        ({"coverage": 1.0}, "coverage"),
        ({"step": 0.5}, "step"),
        ({"reach": 0.01}, "reach"),
        ({"max_turn": np.nan}, "max_turn"),
        ({"name": "nearest"}, "tolerance, random, farthest, variance"),
        ({"pin_radius": -1.0}, "pin_"),
        ({"pin_length": np.nan}, "pin_"),
        ({"pin_length": 5.0}, "pin_"),
        ({"pin_radius": 1.0}, "pin_"),
    ],
)
def test_options_that_plan_nothing_are_refused_by_name(options, word):
    with pytest.raises(ValueError, match=word):
        PlannerOptions(**options)


def test_tell_takes_only_a_touch_and_its_change():
    p = Planner([0, 0, 33], [0, 0, 1])
    plan = p.ask(empty(0.1))
    with pytest.raises(ValueError, match="give the AtlasChange that"):
        p.tell(missed(plan), None)
    with pytest.raises(ValueError, match="give a Touch"):
        p.tell(None, None)
    with pytest.raises(ValueError, match="ask needs the Atlas"):
        p.ask(None)


def first_steps(scale, noise, above=0.0, count=5):
    """The first steps on a ball of 30 to 36, of an atlas of a scale, from a start above it."""
    obj = make_object("sphere")
    start, outward = obj.start()
    atlas, planner = Atlas(0.1, scale=scale), Planner(start + above * outward, outward)
    return atlas, list(explore(atlas, planner, Probe(obj, noise, np.random.default_rng(0)), count))


def test_arms_hidden_by_noise_are_tried_longer():
    """A scale a hundred times too small begins with arms of ten deviations of the noise."""
    atlas, steps = first_steps(1e-3, 0.02, count=3)
    assert steps[0].change.hidden and "noise of 0.02 hides" in steps[0].change.refused
    assert steps[1].plan.reach > 2.0 * steps[0].plan.reach
    assert not steps[1].change.refused and len(atlas)


def test_arms_of_too_few_points_are_tried_shorter():
    """Arms of six radii end, by the turn that is allowed, before they have five points."""
    _, steps = first_steps(1.0, 0.002, count=2)
    assert steps[0].change.refused and not steps[0].change.hidden
    assert steps[1].plan.reach < 0.5 * steps[0].plan.reach


@pytest.mark.parametrize("above", [15.0, 45.0])
def test_a_start_far_above_the_surface_is_looked_for_below(above):
    """A usual first approach looks a hundred scales below: 10 here."""
    atlas, steps = first_steps(0.1, 0.02, above, 2)
    assert steps[0].touch.status is TouchStatus.NO_CONTACT
    assert steps[1].touch.status is TouchStatus.TOUCHED and len(atlas)
    # It begins no higher than the first did.
    tops = [(s.touch.way[0] - steps[0].plan.reference_point) @ s.plan.normal for s in steps]
    assert tops[1] <= tops[0] + 1e-9
