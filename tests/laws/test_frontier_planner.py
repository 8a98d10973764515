"""The planner's protocol: ask and tell, budgets, and the order of its places."""

import numpy as np
import pytest

from tests.explored import ONE_A_TOUCH, explored
from touchatlas.atlas import Atlas, AtlasChange, Touch, TouchStatus
from touchatlas.planner import FrontierOptions, FrontierPlanner, Reason, explore
from touchatlas.sim import Probe, make_object


def planner():
    return FrontierPlanner(np.array([0.0, 0.0, 33.0]), np.array([0.0, 0.0, 1.0]))


def missed(plan):
    return Touch(
        plan.number, plan.reference_point, plan.normal, (), TouchStatus.NO_CONTACT, 0.0, 0.0
    )


def test_tell_fails_without_ask():
    with pytest.raises(ValueError, match="call ask before tell"):
        planner().tell(missed(planner().ask(Atlas(0.1, ONE_A_TOUCH))), AtlasChange())


def test_tell_of_another_plan_is_refused():
    p = planner()
    plan = p.ask(Atlas(0.1, ONE_A_TOUCH))
    other = Touch(plan.number + 1, np.zeros(3), plan.normal, (), TouchStatus.NO_CONTACT, 0.0, 0.0)
    with pytest.raises(ValueError, match="answers plan 1, but plan 0 is open"):
        p.tell(other, AtlasChange())


def test_tell_takes_only_a_touch_and_its_change():
    p = planner()
    plan = p.ask(Atlas(0.1, ONE_A_TOUCH))
    with pytest.raises(ValueError, match="give the Touch and the AtlasChange"):
        p.tell(missed(plan), None)
    with pytest.raises(ValueError, match="the change is that of touch 7, not of 0"):
        p.tell(missed(plan), AtlasChange(touch=7))


def test_asking_twice_answers_the_same():
    p, atlas = planner(), Atlas(0.1, ONE_A_TOUCH)
    assert p.ask(atlas) is p.ask(atlas)


def test_first_plan_is_the_start():
    plan = planner().ask(Atlas(0.1, ONE_A_TOUCH))
    assert plan.reason is Reason.START
    assert plan.reference_point == pytest.approx([0.0, 0.0, 33.0])


def test_nothing_touched_at_the_start_ends_the_exploration():
    p, atlas = planner(), Atlas(0.1, ONE_A_TOUCH)
    steps = list(explore(atlas, p, missed))
    assert len(steps) == 1 and len(atlas) == 0


def test_frontier_is_explored_before_gaps_and_then_nothing_is_left():
    run = explored("sphere")
    p = planner()
    obj = make_object("sphere")
    atlas = Atlas(obj.tolerance, ONE_A_TOUCH)
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    steps = explore(atlas, p, probe)
    # What was still uncovered when each place was chosen: none, when a gap was.
    reasons, uncovered = [], [1]
    for step in steps:
        reasons.append((step.plan.reason, uncovered[-1]))
        uncovered.append(len(atlas.frontier))
    assert reasons[0][0] is Reason.START
    assert all(left > 0 for reason, left in reasons if reason is Reason.EXPAND)
    assert all(left == 0 for reason, left in reasons if reason is Reason.CLOSE_GAP)
    assert p.ask(atlas) is None
    assert len(run.atlas.frontier) == 0 and not atlas.open_outlines().any()


def test_budgets_end_the_exploration():
    obj = make_object("sphere")

    def steps(**budget):
        atlas = Atlas(obj.tolerance, ONE_A_TOUCH)
        probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
        return list(explore(atlas, planner(), probe, **budget))

    assert len(steps(max_touches=4)) == 4
    tracked = [step.touch.tracked_length for step in steps(max_length=500.0)]
    assert sum(tracked) >= 500.0 > sum(tracked[:-1])


def test_short_contours_are_tried_again_closer():
    """A ball of a fiftieth of the first reach: the arms turn away within a step."""
    obj = make_object("ellipsoid_paper")
    start, outward = obj.start()
    atlas = Atlas(0.2, ONE_A_TOUCH)
    probe = Probe(obj, 0.0, np.random.default_rng(0))
    found = list(explore(atlas, FrontierPlanner(start, outward), probe, max_touches=3))
    assert found[0].change.refused
    assert found[1].plan.reach < found[0].plan.reach
    assert found[1].plan.reference_point == pytest.approx(found[0].plan.reference_point)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"curves": 2}, "curves"),
        ({"curves": 2.5}, "curves"),
        ({"samples": 0}, "samples"),
        ({"max_turn": 0.0}, "max_turn"),
        ({"max_turn": np.nan}, "max_turn"),
        ({"reach": -5.0}, "reach"),
        ({"least_reach": 300.0}, "least_reach"),
        ({"reach": np.inf}, "reach"),
    ],
)
def test_options_that_plan_nothing_are_refused_by_name(options, word):
    with pytest.raises(ValueError, match=word):
        FrontierOptions(**options)
