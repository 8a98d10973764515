"""Sources: which of some places is touched next, on places made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from tests.explored import explored
from tests.truths import UP
from tests.unit.planner.seen_places import DEVIATION, PLACES, RIM, SIZE, closed, places, view
from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.body.uncrossed_edges import GuessedEdges
from touchatlas.planner import Planner, PlannerOptions, Reason
from touchatlas.planner import sources as listed
from touchatlas.planner.attempts import Attempts, Target
from touchatlas.planner.places import Places, places_of
from touchatlas.planner.sources import (
    SOURCES,
    guessed_edge,
    largest_sum_about,
    next_target,
    next_tolerance,
)
from touchatlas.planner.view import Phase, View


def baseline(name: str, seen: View, places: Places) -> Target | None:
    options = PlannerOptions(name=name)
    return next_target(replace(seen, phase=Phase.COMPARE, options=options), places)


def test_a_large_opening_is_touched_first_and_far_from_touches():
    """Of two middles of its rim the farther one: the square of the distance grows faster than the
    way to it."""
    target = next_target(view(), places())
    assert target.reason is Reason.EXPAND
    assert target.point.tolist() == RIM[1].tolist() and target.normal.tolist() == UP.tolist()


def test_an_opening_that_was_reached_in_vain_is_touched_elsewhere():
    """Attempts in vain count as reached: the other middle is farther from all of them then."""
    target = next_target(view(in_vain=[RIM[1]]), places())
    assert target.point.tolist() == RIM[0].tolist()


def test_where_the_surface_is_closed_a_touch_brings_most_area_within_the_next_tolerance():
    """A place of little area is worth no more than that, however large its error is: of an area of
    0.015 with a deviation of 3, and two next to each other of 1 with 0.2, these are touched, though
    the first one has more of the variance, 0.135 of 0.215."""
    some = replace(
        closed(np.array([0.001, 0.01, 3.0, 0.2, 0.2])), area=np.array([1.0, 1.0, 0.015, 1.0, 1.0])
    )
    target = next_target(view(), some)
    assert target.reason is Reason.REFINE
    assert target.point.tolist() in PLACES[3:].tolist()


@pytest.mark.parametrize(("deviation", "power"), [(0.01, -2), (0.02, -1), (0.16, 2)])
def test_the_next_tolerance_is_a_power_of_two_that_most_places_miss(deviation, power):
    """Of errors of t with seven degrees of freedom 0.995 are within 4.03 of its scale: 0.8 of the
    deviation, and a floor of 0.3 of a sample's, 0.006. Powers of two are times a scale of 0.1."""
    sure = closed(np.full(5, deviation))
    limit = 4.03 * np.hypot(0.8 * deviation, 0.006)
    found = next_tolerance(view(), sure)
    assert found == 0.1 * 2.0**power and found < limit <= 2.0 * found


def test_where_no_surface_is_wanted_no_place_is_vague():
    """Of a region beyond what is known there may be rims alone, and of these none that is free: a
    search for the next tolerance ends there, too."""
    some = closed(np.full(5, 0.2))
    nothing = some.some(np.zeros(len(some.points), bool), np.ones(len(some.rim), bool))
    assert next_target(view(), nothing) is None


def test_of_places_of_equal_gain_the_nearer_one_is_touched():
    """The way from the last touch is part of what a touch costs."""
    apart = np.array(
        [[5.0, 0.0, 0.0], [-9.0, 0.0, 0.0], [0.0, 20.0, 0.0], [9.9, 20.0, 0.0], PLACES[4]]
    )
    some = replace(closed(np.array([0.2, 0.2, 0.001, 0.001, 0.001])), points=apart)
    assert next_target(view(), some).point.tolist() == apart[0].tolist()


def test_places_that_are_surer_than_samples_need_no_touch():
    """A sample's deviation is 0.02 without noise, the lack of fit that is borne; three tenths of it
    are 0.006."""
    assert view().atlas.sample_std == pytest.approx(0.02)
    assert next_target(view(), closed(np.full(5, 0.0059))) is None
    assert next_target(view(), closed(np.full(5, 0.0061))) is not None


def test_small_holes_come_last():
    """A hole of a fiftieth of the extent waits until all else is known."""
    one_hole = RIM[2:], SIZE[2:]
    assert next_target(view(), places(DEVIATION, *one_hole)).reason is Reason.REFINE
    target = next_target(view(), places(np.full(5, 0.001), *one_hole))
    assert target.reason is Reason.EXPAND and target.point.tolist() == RIM[2].tolist()


def test_where_all_was_tried_there_is_no_target():
    everywhere = view(np.concatenate([PLACES, RIM]))
    for phase in Phase.GROW, Phase.FINISH, Phase.END:
        assert next_target(replace(everywhere, phase=phase), places()) is None
    for name in "random", "farthest", "variance":
        assert baseline(name, everywhere, places()) is None


def test_pending_plans_keep_others_ten_times_as_far_away():
    """2 % of the extent is 0.2, and a tenth of the distance to a pending plan counts: places within
    2 of it are not free."""
    target = next_target(view(pending=[[5.0, 0.0, 0.0]]), closed())
    assert target.point.tolist() == PLACES[1].tolist()


def test_random_touches_each_place_by_its_share_of_the_area():
    """A place of half the area is drawn half of the time: 400 even draws are off by one at most."""
    some = replace(closed(), area=np.array([1.0, 1.0, 1.0, 1.0, 4.0]))
    draws, far = (np.arange(400) + 0.5) / 400, view([[0.0, 50.0, 0.0]])
    drawn = [baseline("random", replace(far, draw=draw), some).point.tolist() for draw in draws]
    assert abs(drawn.count(PLACES[4].tolist()) - 200) <= 1
    # Places that were touched are not drawn.
    drawn = [baseline("random", replace(view(), draw=d), closed()).point.tolist() for d in draws]
    assert PLACES[0].tolist() not in drawn and PLACES[1].tolist() in drawn
    with pytest.raises(ValueError, match="the planner random needs rng"):
        Planner(np.zeros(3), UP, PlannerOptions(name="random"))


def test_farthest_is_the_place_farthest_from_all_touches():
    """Of rims and known places alike."""
    assert baseline("farthest", view(), places()).point.tolist() == RIM[1].tolist()
    target = baseline("farthest", view(), closed())
    assert target.point.tolist() == PLACES[4].tolist() and target.reason is Reason.REFINE


def test_variance_is_the_rim_next_to_the_last_touch_and_else_the_least_sure_place():
    last = view([[0.0, 0.0, 0.0], [8.0, 2.0, 0.0]])
    assert baseline("variance", last, places()).point.tolist() == RIM[0].tolist()
    target = baseline("variance", view(), closed())
    assert target.point.tolist() == PLACES[1].tolist() and target.reason is Reason.REFINE


def test_the_nearest_edge_that_is_drawn_by_a_guess_is_touched(monkeypatch):
    """Until it is touched, or was tried in vain; then the next one."""
    found = GuessedEdges(PLACES[[3, 1]], np.tile(UP, (2, 1)), 1.0)
    monkeypatch.setattr(listed, "guessed_edges", lambda body, tolerance: found)
    body = KnownBody(body=SimpleNamespace())

    def target(*touched):
        seen = view([[0.0, 0.0, 0.0], *touched])
        seen.atlas.known_body = body
        return guessed_edge(seen, closed())

    assert target().point.tolist() == PLACES[1].tolist()
    assert target().normal.tolist() == UP.tolist()
    assert target(PLACES[1]).point.tolist() == PLACES[3].tolist()
    assert target(PLACES[1], PLACES[3]) is None
    assert guessed_edge(view(), closed()) is None


def vague_places(seed: int):
    """Places (2000, 3) on two sides of a wall, with values that grow towards some of them."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (2000, 3)) * [1.0, 1.0, 0.0]
    points[::2, 2] = 0.05
    vague = rng.uniform(-1.0, 1.0, (5, 3))
    return points, np.exp(-4.0 * cdist(points, vague).min(axis=1)) * rng.uniform(0.5, 1.5, 2000)


@pytest.mark.parametrize("seed", range(5))
def test_the_sum_about_a_place_is_nearly_the_largest(seed):
    """One place in each cube of a radius is compared, so that some place compared is within a
    diagonal of the best: with values that fall by e in 1.25 radii, at least 0.8 of its sum."""
    points, values = vague_places(seed)
    asked = np.flatnonzero(points[:, 0] < 0.7)
    sums = (cdist(points[asked], points) <= 0.2) @ values
    found = largest_sum_about(points, values, asked, 0.2, np.ones(len(points)))
    assert sums[asked == found] >= 0.8 * sums.max()


def test_the_order_is_one_list_without_repeats():
    sources = [source for source, _ in SOURCES]
    assert isinstance(SOURCES, tuple) and len(set(sources)) == len(sources)
    assert {phase for _, phases in SOURCES for phase in phases} == set(Phase)


@pytest.fixture(scope="module")
def bottle():
    """An explored bottle, and its places in arrays that may not be written."""
    found = explored("bottle")
    places = places_of(found.atlas)
    for array in [*vars(places).values(), *vars(places.surface).values()]:
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return found, places


@pytest.mark.parametrize("phase", list(Phase))
def test_a_source_gives_the_same_target_of_the_same_view_and_changes_nothing(bottle, phase):
    """Each source alone, on a bottle: twice the same target, from arrays that may not be written,
    and the target of the list is that of its first source that has one."""
    found, places = bottle
    attempts = Attempts(np.array([0.0, 0.0, 90.0]), UP)
    attempts.touched = [touch.contact for touch in found.touches[:4]]
    attempts.missed = [Target(np.array([0.0, 90.0, 0.0]), np.array([0.0, 1.0, 0.0]), Reason.EXPAND)]
    options = PlannerOptions(name="random" if phase is Phase.COMPARE else "tolerance", search=1)
    before, seen = repr(attempts), View(found.atlas, options, attempts, phase, 0.5)
    targets = [source(seen, places) for source, phases in SOURCES if phase in phases]
    again = [source(seen, places) for source, phases in SOURCES if phase in phases]
    for one, other in zip(targets, again, strict=True):
        assert (one is None) == (other is None)
        assert one is None or _numbers(one) == _numbers(other)
    first = next(target for target in targets if target is not None)
    assert _numbers(next_target(seen, places)) == _numbers(first)
    assert repr(attempts) == before


def _numbers(target: Target) -> list:
    return [np.asarray(value).tolist() for value in vars(target).values() if value is not None]
