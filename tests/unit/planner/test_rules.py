"""Rules: which of some places is touched next, on places made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from touchatlas.atlas import Atlas
from touchatlas.atlas.body.guessed_edges import GuessedEdges
from touchatlas.atlas.body.known_body import KnownBody
from touchatlas.planner import PlannerOptions, Reason
from touchatlas.planner.place import rules
from touchatlas.planner.place.choose import View
from touchatlas.planner.place.places import Places
from touchatlas.planner.place.rules import (
    RULES,
    farthest,
    guessed_edge_target,
    left_target,
    random,
    tolerance,
    variance,
)

UP = np.array([0.0, 0.0, 1.0])
NOWHERE = np.zeros((0, 3))
EXTENT = 10.0
# Places along x, known to 1 to 5 hundredths; the last two are next to each other.
PLACES = np.array([[0.0, 0, 0], [2.0, 0, 0], [4.0, 0, 0], [6.0, 0, 0], [6.1, 0, 0]])
DEVIATION = np.array([0.01, 0.05, 0.03, 0.04, 0.04])
# Middles of the rim of a large opening, and of a hole of a fiftieth of the extent.
RIM = np.array([[9.0, 1, 0], [9.0, 4, 0], [3.0, 0, 0]])
SIZE = np.array([5.0, 5.0, 0.2])


def places(deviation=DEVIATION, rim=RIM, size=SIZE) -> Places:
    count, ends = len(deviation), len(rim)
    return Places(
        PLACES[:count],
        np.tile(UP, (count, 1)),
        np.asarray(deviation, float),
        np.ones(count),
        np.reshape(rim, (-1, 3)),
        np.tile(UP, (ends, 1)),
        np.ones(ends),
        np.asarray(size, float),
        np.zeros(ends),
    )


def view(touched=((0.0, 0.0, 0.0),), pending=NOWHERE, in_vain=NOWHERE) -> View:
    touched = np.reshape(np.asarray(touched, float), (-1, 3))
    pending, in_vain = (np.reshape(np.asarray(x, float), (-1, 3)) for x in (pending, in_vain))
    done = np.concatenate([touched, in_vain])
    return View(Atlas(0.1), 1.0, touched, done, in_vain, pending, EXTENT)


def closed(deviation=DEVIATION) -> Places:
    return places(deviation, NOWHERE, np.zeros(0))


def test_a_large_opening_is_touched_first_and_far_from_touches():
    """Of two middles of its rim the farther one: the square of the distance grows faster than the
    way to it."""
    target = tolerance(view(), places(), None)
    assert target.reason is Reason.EXPAND
    assert target.point.tolist() == RIM[1].tolist() and target.normal.tolist() == UP.tolist()


def test_an_opening_that_was_reached_in_vain_is_touched_elsewhere():
    """Attempts in vain count as reached: the other middle is farther from all of them then."""
    target = tolerance(view(in_vain=[RIM[1]]), places(), None)
    assert target.point.tolist() == RIM[0].tolist()


def test_where_the_surface_is_closed_a_touch_takes_most_of_the_variance():
    """Two places of 0.04 next to each other hold 0.0032, more than one of 0.05 with 0.0025. What a
    few samples would know is taken off: three tenths of a sample's deviation, 0.006, at each."""
    target = tolerance(view(), closed(), None)
    assert target.reason is Reason.REFINE
    assert target.point.tolist() in PLACES[3:].tolist()


def test_places_that_are_surer_than_samples_need_no_touch():
    """A sample's deviation is 0.02 without noise, the lack of fit that is borne; three tenths of it
    are 0.006."""
    assert view().atlas.sample_std == pytest.approx(0.02)
    assert tolerance(view(), closed(np.full(5, 0.0059)), None) is None
    assert tolerance(view(), closed(np.full(5, 0.0061)), None) is not None


def test_small_holes_come_last():
    """A hole of a fiftieth of the extent waits until all else is known."""
    one_hole = RIM[2:], SIZE[2:]
    assert tolerance(view(), places(DEVIATION, *one_hole), None).reason is Reason.REFINE
    target = tolerance(view(), places(np.full(5, 0.001), *one_hole), None)
    assert target.reason is Reason.EXPAND and target.point.tolist() == RIM[2].tolist()


@pytest.mark.parametrize("rule", ["tolerance", "farthest", "variance"])
def test_where_all_was_tried_there_is_no_target(rule):
    everywhere = np.concatenate([PLACES, RIM])
    assert RULES[rule](view(everywhere), places(), None) is None


def test_pending_plans_keep_others_ten_times_as_far_away():
    """2 % of the extent is 0.2, and a tenth of the distance to a pending plan counts: places within
    2 of it are not free."""
    target = tolerance(view(pending=[[5.0, 0.0, 0.0]]), closed(), None)
    assert target.point.tolist() == PLACES[1].tolist()


def test_random_touches_each_place_by_its_share_of_the_area():
    """A place of half the area is drawn half of the time: 400 draws have a standard error of
    0.025."""
    area = np.array([1.0, 1.0, 1.0, 1.0, 4.0])
    some, rng = replace(closed(), area=area), np.random.default_rng(0)
    far = view([[0.0, 50.0, 0.0]])
    drawn = [random(far, some, rng).point.tolist() for _ in range(400)]
    share = np.mean([point == PLACES[4].tolist() for point in drawn])
    assert share == pytest.approx(0.5, abs=4.0 * 0.025)
    # Places that were touched are not drawn.
    drawn = [random(view(), closed(), rng).point.tolist() for _ in range(50)]
    assert PLACES[0].tolist() not in drawn
    with pytest.raises(ValueError, match="the rule random needs rng"):
        random(view(), closed(), None)
    assert random(view(PLACES), closed(), rng) is None


def test_farthest_is_the_place_farthest_from_all_touches():
    """Of rims and known places alike."""
    assert farthest(view(), places(), None).point.tolist() == RIM[1].tolist()
    target = farthest(view(), closed(), None)
    assert target.point.tolist() == PLACES[4].tolist() and target.reason is Reason.REFINE


def test_variance_is_the_rim_next_to_the_last_touch_and_else_the_least_sure_place():
    last = [[0.0, 0.0, 0.0], [8.0, 2.0, 0.0]]
    assert variance(view(last), places(), None).point.tolist() == RIM[0].tolist()
    target = variance(view(), closed(), None)
    assert target.point.tolist() == PLACES[1].tolist() and target.reason is Reason.REFINE


def test_a_rule_that_is_none_is_refused_with_those_that_are():
    with pytest.raises(ValueError, match="tolerance, random, farthest, variance"):
        PlannerOptions(name="gpis")


def test_the_nearest_edge_that_is_drawn_by_a_guess_is_touched(monkeypatch):
    """Until it is touched, or was tried in vain; then the next one."""
    found = GuessedEdges(PLACES[[3, 1]], np.tile(UP, (2, 1)), 1.0)
    monkeypatch.setattr(rules, "guessed_edges", lambda body, tolerance: found)
    with_body = view()
    with_body.atlas.know(KnownBody(body=SimpleNamespace(with_air=lambda ways: SimpleNamespace())))
    target = guessed_edge_target(with_body)
    assert target.point.tolist() == PLACES[1].tolist() and target.normal.tolist() == UP.tolist()
    target = guessed_edge_target(replace(with_body, done=PLACES[1:2]))
    assert target.point.tolist() == PLACES[3].tolist()
    assert guessed_edge_target(replace(with_body, done=PLACES[[1, 3]])) is None
    assert guessed_edge_target(view()) is None


def test_holes_within_the_tolerance_are_looked_for_until_the_surface_is_known(monkeypatch):
    """So that touches to a looser tolerance are the first of those to a tighter one."""
    borne: list[float] = []

    def asked(view, places, most=0.0):
        borne.append(most)

    monkeypatch.setattr(rules, "hidden_hole_target", asked)
    tolerance(view(), closed(), None)
    left_target(view(), closed())
    assert borne == [0.0, view().atlas.tolerance]
