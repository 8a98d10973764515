"""The list of holes: when the surface is drawn, and which holes are worth a touch."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.planner.place import hole_list
from touchatlas.planner.place.choose import View
from touchatlas.planner.place.hole_list import HoleList
from touchatlas.planner.place.holes import Holes
from touchatlas.planner.place.places import Places

EXTENT = 100.0
NONE = np.zeros((0, 3))
# Two holes far from the ball that was touched, which has a radius of 33.
FAR = Holes(np.diag([200.0, 300.0, 400.0])[:2], np.eye(3)[:2], np.ones(2), np.array([0.3, 0.7]))


@pytest.fixture
def view():
    return View(explored("sphere", max_touches=3).atlas, Places(), NONE, NONE, NONE, NONE, EXTENT)


@pytest.fixture
def drawn(monkeypatch):
    """The tolerances that the surface was drawn to."""
    levels = []

    def draw(_, tolerance):
        levels.append(tolerance)
        return FAR

    monkeypatch.setattr(hole_list, "drawn_holes", draw)
    return levels


def test_the_surface_is_drawn_each_time_it_is_known_twice_as_well(view, drawn):
    holes = HoleList()
    for known in (6.0, 5.0, 3.0, 2.5, 2.0, 0.6):
        holes.update(view, lambda length, known=known: length >= known)
    assert drawn == [5.0, 2.5, 0.625]


def test_a_hole_is_touched_if_it_is_less_sure_than_the_surface_is(view, drawn):
    """The worst first; and it is left at a tolerance that a surface across it meets."""
    holes = HoleList()
    assert holes.any_left(view, 1.0)
    holes.update(view, lambda length: length >= 0.5)
    assert holes.target(view, lambda length: length >= 0.8) is None
    assert holes.target(view, lambda length: length >= 0.5).point.tolist() == [0.0, 300.0, 0.0]
    assert holes.any_left(view, 0.6) and not holes.any_left(view, 0.8)
    done = replace(view, done=FAR.centres[1:])
    assert holes.target(done, lambda length: length >= 0.5) is None


def test_the_surface_is_drawn_again_where_holes_were_touched_some_times_at_most(view, drawn):
    holes = HoleList()
    holes.update(view, lambda length: length >= 0.5)
    done = replace(view, done=FAR.centres[1:])
    for _ in range(2 * hole_list._LOOKS):
        holes._drawn = FAR
        holes.update(done, lambda length: length >= 0.5)
    assert len(drawn) == hole_list._LOOKS and not holes.looks_left


def test_a_hole_that_a_contour_crossed_is_not_touched(view, drawn):
    """The samples of the ball count as tracked since the holes were drawn."""
    holes = HoleList()
    holes.update(view, lambda length: length >= 0.5)
    point = view.atlas.membership.pool.points[0]
    holes._drawn = replace(FAR, centres=np.stack([FAR.centres[0], point + 0.5]))
    assert holes.target(view, lambda length: length >= 0.2).point.tolist() == [200.0, 0.0, 0.0]
