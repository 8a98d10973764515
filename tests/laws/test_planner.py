"""The planner's protocol: ask and tell, budgets, and the order of its places."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.atlas import Atlas, AtlasChange, Touch, TouchStatus
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.sim import Probe, make_object


def planner():
    return Planner(np.array([0.0, 0.0, 33.0]), np.array([0.0, 0.0, 1.0]))


def missed(plan):
    return Touch(
        plan.number, plan.reference_point, plan.normal, (), TouchStatus.NO_CONTACT, 0.0, 0.0
    )


def test_tell_fails_without_ask():
    with pytest.raises(ValueError, match="call ask before tell"):
        planner().tell(missed(planner().ask(Atlas(0.1))), AtlasChange())


def test_tell_of_another_plan_is_refused():
    p = planner()
    plan = p.ask(Atlas(0.1))
    other = Touch(plan.number + 1, np.zeros(3), plan.normal, (), TouchStatus.NO_CONTACT, 0.0, 0.0)
    with pytest.raises(ValueError, match="answers plan 1, but plan 0 is open"):
        p.tell(other, AtlasChange())


def test_asking_twice_answers_the_same():
    p, atlas = planner(), Atlas(0.1)
    assert p.ask(atlas) is p.ask(atlas)


def test_first_plan_is_the_start():
    plan = planner().ask(Atlas(0.1))
    assert plan.reason is Reason.START
    assert plan.reference_point == pytest.approx([0.0, 0.0, 33.0])


def test_a_first_touch_that_meets_nothing_is_tried_elsewhere_and_then_given_up():
    """24 places about the start, no two alike; then the planner says that no touch gave a patch."""
    p, atlas = planner(), Atlas(0.1)
    steps = list(explore(atlas, p, missed))
    points = np.array([step.plan.reference_point for step in steps])
    assert len(np.unique(points.round(6), axis=0)) == len(points) == 24
    assert len(atlas) == 0 and p.stop.reason is StopReason.NO_PATCH


@pytest.mark.parametrize("name", ["sphere", "bottle"])
def test_the_surface_is_known_to_the_tolerance_at_the_end(name):
    """The predicted coverage is that of the truth, to 0.01: the share of 4,000 points that lie
    within the tolerance has a standard error of 0.001."""
    obj = make_object(name)
    atlas, p = Atlas(obj.tolerance), Planner(*obj.start())
    list(explore(atlas, p, Probe(obj, obj.noise_std, np.random.default_rng(1))))
    assert p.stop.reason is StopReason.KNOWN
    points, _ = obj.sample(4000, np.random.default_rng(2))
    distance = np.abs(np.nan_to_num(atlas.blend(points).distance, nan=np.inf))
    assert (distance <= obj.tolerance).mean() == pytest.approx(
        p.stop.forecast.predicted_coverage, abs=0.01
    )


def test_a_looser_tolerance_ends_the_same_touches_earlier():
    obj = make_object("ellipsoid")
    sequences = []
    for tolerance in (0.1, 0.4):
        atlas, p = Atlas(tolerance, scale=0.1), Planner(*obj.start())
        probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
        steps = explore(atlas, p, probe)
        sequences.append([step.plan.reference_point.tolist() for step in steps])
        assert p.stop.reason is StopReason.KNOWN
    fine, coarse = sequences
    assert len(coarse) < len(fine) and coarse == fine[: len(coarse)]


def test_arms_end_where_the_surface_is_known():
    """A touch beside another one tracks less than one far from all others."""
    obj = make_object("sphere")
    atlas, p = Atlas(obj.tolerance), planner()
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    steps = list(explore(atlas, p, probe))
    last = steps[-1]
    free = probe(replace(last.plan, until=None))
    assert last.touch.tracked_length < 0.8 * free.tracked_length


def test_budgets_end_the_exploration():
    obj = make_object("sphere")

    def steps(**budget):
        atlas = Atlas(obj.tolerance)
        probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
        return list(explore(atlas, planner(), probe, **budget))

    assert len(steps(max_touches=4)) == 4
    tracked = [step.touch.tracked_length for step in steps(max_length=500.0)]
    assert sum(tracked) >= 500.0 > sum(tracked[:-1])


def test_short_contours_are_tried_again_closer():
    """The object is a fortieth of the first reach across: the arms turn away within a few steps."""
    obj = make_object("ellipsoid_paper")
    start, outward = obj.start()
    atlas = Atlas(3.0)
    probe = Probe(obj, 0.0, np.random.default_rng(0))
    found = list(explore(atlas, Planner(start, outward), probe, max_touches=3))
    assert found[0].change.refused
    assert found[1].plan.reach < found[0].plan.reach
    assert found[1].plan.reference_point == pytest.approx(found[0].plan.reference_point)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"curves": 2}, "curves"),
        ({"curves": 2.5}, "curves"),
        ({"curves": 10**6}, "curves"),
        ({"coverage": 1.0}, "coverage"),
        ({"step": 0.5}, "step"),
        ({"max_turn": 0.0}, "max_turn"),
        ({"max_turn": np.nan}, "max_turn"),
        ({"reach": -5.0}, "reach"),
        ({"reach": 0.01}, "reach"),
        ({"reach": np.inf}, "reach"),
    ],
)
def test_options_that_plan_nothing_are_refused_by_name(options, word):
    with pytest.raises(ValueError, match=word):
        PlannerOptions(**options)
