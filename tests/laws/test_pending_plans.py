"""Several pending plans, answered in any order or lost, and planners that come back from a file."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import missed
from touchatlas.atlas import Atlas, load_atlas, save_atlas
from touchatlas.planner import (
    Planner,
    PlannerOptions,
    StopReason,
    explore,
    load_planner,
    save_planner,
)
from touchatlas.sim import Probe, make_object


def begun(name="sphere", rule="tolerance", tolerance=None, **options):
    """An object's empty atlas, planner and probe."""
    obj = make_object(name)
    atlas = Atlas(obj.tolerance if tolerance is None else tolerance, scale=obj.tolerance)
    planner = Planner(*obj.start(), PlannerOptions(name=rule, **options), np.random.default_rng(3))
    return atlas, planner, Probe(obj, obj.noise_std, np.random.default_rng(1))


def short(touch):
    """A touch whose contours are too short for a patch, so that it is refused."""
    return replace(touch, contours=tuple(replace(c, points=c.points[:2]) for c in touch.contours))


def answered(atlas, planner, touch):
    change = atlas.add(touch)
    planner.tell(touch, change)
    return change


def advance(atlas, planner, probe, count):
    """The numbers, places and directions of the next plans, each answered before the next."""
    out = []
    while len(out) < count and (plan := planner.ask(atlas)) is not None:
        answered(atlas, planner, probe(plan))
        planes = [plane.normal.tolist() for plane in plan.planes]
        until = plan.until is None
        out.append([plan.number, plan.reference_point.tolist(), planes, plan.reach, until])
    return out


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [pytest.param("ellipsoid", 2.0, marks=pytest.mark.slow), ("sphere", 0.3)],
)
def test_plans_told_in_any_order_lead_to_a_known_surface(name, tolerance):
    """Four arms; every sixth touch misses, every sixth is refused, every sixth is lost: it is made
    again later, by the plan that is still pending."""
    atlas, planner, probe = begun(name, tolerance=tolerance)
    rng, made, lost = np.random.default_rng(0), 0, 0
    while plans := planner.ask_several(atlas, 4):
        assert planner.stop is None and planner.ask(atlas) is plans[0]
        plan = plans[rng.integers(len(plans))]
        fate, made = rng.integers(6), made + 1
        if fate == 0:
            lost += 1
            assert plan in planner.ask_several(atlas, 4)
            continue
        touch = missed(plan) if fate == 1 else probe(plan)
        change = answered(atlas, planner, short(touch) if fate == 2 else touch)
        assert change.refused or fate not in (1, 2)
        assert made < 150
    assert planner.stop.reason is StopReason.KNOWN and lost > 0
    assert planner.stop.forecast.predicted_coverage >= 0.995
    atlas.validate()


def test_pending_plans_have_places_of_their_own():
    """No two are within a tenth of the extent of what was touched; each keeps its number."""
    atlas, planner, probe = begun()
    advance(atlas, planner, probe, 2)
    plans = planner.ask_several(atlas, 4)
    assert [plan.number for plan in plans] == [2, 3, 4, 5]
    places = np.array([plan.reference_point for plan in plans])
    apart = np.linalg.norm(places[:, None] - places, axis=2) + np.diag(np.full(4, np.inf))
    points = atlas.pool.points
    assert apart.min() > 0.1 * np.linalg.norm(np.ptp(points, axis=0))
    assert planner.ask_several(atlas, 4) == plans and planner.ask_several(atlas, 2) == plans
    answered(atlas, planner, probe(plans[2]))
    left = planner.ask_several(atlas, 3)
    assert left == (plans[0], plans[1], plans[3])


def test_one_plan_at_a_time_is_the_sequence_of_ask():
    asked = advance(*begun(), 5)
    atlas, planner, probe = begun()
    for number, place, *_ in asked:
        (plan,) = planner.ask_several(atlas, 1)
        assert (plan.number, plan.reference_point.tolist()) == (number, place)
        answered(atlas, planner, probe(plan))


def test_guesses_behind_edges_are_made_one_at_a_time():
    """The next guess depends on the last touch; another arm touches elsewhere meanwhile."""
    atlas, planner, probe = begun("cube", max_turn=0.8)
    (plan,) = planner.ask_several(atlas, 2)
    answered(atlas, planner, probe(plan))
    guesses = []
    for _ in range(6):
        plans = planner.ask_several(atlas, 2)
        assert len(plans) == 2
        pending = planner._attempts.pending
        guesses.append(sum(pending[one.number].target.end is not None for one in plans))
        answered(atlas, planner, probe(plans[0]))
    assert max(guesses) == 1 and guesses.count(1) >= 3


def test_a_touch_is_told_once_and_by_a_number_that_is_pending():
    atlas, planner, probe = begun()
    advance(atlas, planner, probe, 2)
    first, second = planner.ask_several(atlas, 2)
    touch = probe(second)
    change = answered(atlas, planner, touch)
    with pytest.raises(ValueError, match="the touch answers plan 3, but plan 2 is open"):
        planner.tell(touch, change)
    third = planner.ask_several(atlas, 2)[1]
    assert (first.number, third.number) == (2, 4)
    with pytest.raises(ValueError, match="answers plan 3, but plans 2, 4 are open"):
        planner.tell(touch, change)
    with pytest.raises(ValueError, match="count is True; it must be a whole number"):
        planner.ask_several(atlas, True)
    with pytest.raises(ValueError, match="count is 0; it must be a whole number"):
        planner.ask_several(atlas, 0)


def test_a_new_planner_goes_on_with_an_atlas_that_learned_before():
    atlas, planner, probe = begun()
    advance(atlas, planner, probe, 2)
    other = begun()[1]
    assert other.ask(atlas) is not None


@pytest.mark.parametrize(
    ("name", "rule", "count", "options"),
    [
        ("sphere", "tolerance", 0, {}),
        ("ellipsoid", "tolerance", 3, {}),
        ("sphere", "random", 2, {}),
        # One of the pending plans is a guess behind an edge.
        ("cube", "tolerance", 4, {"max_turn": 0.8}),
        ("sphere", "farthest", 2, {}),
        ("sphere", "variance", 2, {}),
    ],
)
def test_a_loaded_planner_goes_on_as_the_one_that_was_never_saved(
    name, rule, count, options, tmp_path
):
    """With the loaded atlas it makes the same plans, number by number, and the one that is pending
    comes back. Saved again it gives the same bytes."""
    atlas, planner, probe = begun(name, rule, **options)
    advance(atlas, planner, probe, count)
    pending = planner.ask_several(atlas, 2)
    guesses = [one.target.end is not None for one in planner._attempts.pending.values()]
    assert any(guesses) == (name == "cube")
    save_atlas(tmp_path / "atlas.npz", atlas)
    save_planner(tmp_path / "planner.json", planner, atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    loaded = load_planner(tmp_path / "planner.json", again)
    assert [p.number for p in loaded.ask_several(again, 1)] == [p.number for p in pending]
    save_planner(tmp_path / "again.json", loaded, again)
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "planner.json").read_bytes()
    state = probe.state()
    expected = advance(atlas, planner, probe, 3)
    probe.restore(state)
    assert advance(again, loaded, probe, 3) == expected and len(expected) == 3


def test_a_retry_and_the_end_come_back_from_a_file(tmp_path):
    path = tmp_path / "planner.json"
    atlas, planner, probe = begun("sphere", tolerance=0.3)
    answered(atlas, planner, short(probe(planner.ask(atlas))))
    save_planner(path, planner, atlas)
    closer, again = planner.ask(atlas), load_planner(path, atlas).ask(atlas)
    assert again.reach == closer.reach and again.number == closer.number == 1
    advance(atlas, planner, probe, 100)
    save_planner(path, planner, atlas)
    stop = load_planner(path, atlas).stop
    assert stop.reason is planner.stop.reason is StopReason.KNOWN
    assert stop.forecast.predicted_coverage == planner.stop.forecast.predicted_coverage


def test_an_approach_that_points_into_the_surface_is_refused():
    """The loop ends there, and does not explore a body that is partly inside out."""
    atlas, planner, probe = begun()
    touch = probe(planner.ask(atlas))
    inward = replace(touch, approach=-touch.approach, way=None)
    with pytest.raises(ValueError, match="approach of touch 0 points into the surface .* give the"):
        planner.tell(inward, Atlas(0.1).add(inward))
    answered(atlas, planner, touch)


@pytest.mark.parametrize(
    ("spoiled", "said"),
    [
        (lambda touch: replace(touch, tip_radius=1.0), "has a tip radius of 1"),
        (lambda touch: replace(touch, approach=-touch.approach, way=None), "points into the surf"),
        (lambda touch: replace(touch, number=7), "answers plan 7, but plan 1 is open"),
        (lambda touch: None, "got NoneType; give a Touch"),
        (lambda touch: 1 / 0, "division by zero"),
    ],
)
def test_a_touch_that_ends_the_loop_changes_nothing_and_is_asked_for_again(spoiled, said):
    """What follows is that of the loop without it; the robot touches that place once more."""
    found = []
    for wrong in (spoiled, None):
        atlas, planner, probe = begun()
        list(explore(atlas, planner, probe, 1))
        if wrong:
            state = probe.state()
            with pytest.raises((ValueError, ZeroDivisionError), match=said) as end:
                list(explore(atlas, planner, lambda plan, p=probe, w=wrong: w(p(plan)), 1))
            probe.restore(state)
            notes = getattr(end.value, "__notes__", ["asks for this touch again"])
            assert "asks for this touch again" in notes[0] and atlas.touches == 1
        list(explore(atlas, planner, probe, 2))
        found.append(atlas.pool.points)
    assert np.array_equal(*found)


def test_a_planner_is_refused_beside_another_atlas(tmp_path):
    """Of other touches, of fewer, or of the same with another tolerance or without their ways; not
    of more, as after a crash between saving the atlas and saving the planner."""
    path = tmp_path / "planner.json"
    atlas, planner, probe = begun()
    touches = [probe(planner.ask(atlas))]
    few = begun()[0]
    for one in (atlas, few):
        change = one.add(touches[0])
    planner.tell(touches[0], change)
    touches.append(probe(planner.ask(atlas)))
    answered(atlas, planner, touches[1])
    save_planner(path, planner, atlas)
    looser, other, wayless = begun(tolerance=0.3)[0], begun("ellipsoid"), begun()[0]
    for touch in touches:
        looser.add(touch)
        wayless.add(replace(touch, way=None))
    advance(*other, 3)
    for wrong in (few, looser, other[0], wayless, begun()[0]):
        with pytest.raises(ValueError, match="was saved with another atlas .* begin with a new"):
            load_planner(path, wrong)
    lost = probe(planner.ask(atlas))
    atlas.add(lost)
    assert load_planner(path, atlas).ask(atlas).number == lost.number
    for call in (lambda: load_planner(path, 3), lambda: save_planner(path, planner, 3)):
        with pytest.raises(ValueError, match="got int for the atlas; give the one of the planner"):
            call()
    with pytest.raises(ValueError, match="got int for the planner"):
        save_planner(path, 3, atlas)


def test_a_finished_atlas_or_one_that_learned_the_touches_again_is_the_same(tmp_path):
    path = tmp_path / "planner.json"
    atlas, planner, probe = begun()
    again = begun()[0]
    for _ in range(3):
        touch = probe(planner.ask(atlas))
        again.add(touch)
        answered(atlas, planner, touch)
    save_planner(path, planner, atlas)
    atlas.finish()
    for right in (atlas, again):
        assert load_planner(path, right).ask(right) is not None


def test_a_planner_that_cannot_be_written_leaves_the_old_file(tmp_path):
    path = tmp_path / "planner.json"
    atlas, planner, _ = begun()
    save_planner(path, planner, atlas)
    before = path.read_bytes()
    planner.extra = object()
    with pytest.raises(TypeError, match="cannot be saved"):
        save_planner(path, planner, atlas)
    assert path.read_bytes() == before
