"""A feature that is asked for: touches go on until no disc of its diameter is without a sample."""

import numpy as np
import pytest

from tests.explored import explore_body, explored, learned, spread_touches
from touchatlas.planner import PlannerOptions, StopReason
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.features import free_disc, missed_feature
from touchatlas.planner.places import places_of
from touchatlas.planner.view import Phase, View
from touchatlas.sim import make_object


def test_every_end_says_how_large_a_hole_may_have_been_missed():
    """The disc of the stop is that of the true surface, to the fifth that is asked for."""
    found = explored("sphere")
    disc = found.stop.free_disc
    points = make_object("sphere").sample(20_000, np.random.default_rng(1))[0]
    true = 2.0 * found.atlas.body.away(points).max()
    assert disc.diameter == pytest.approx(true, rel=0.05)
    assert f"{disc.diameter:.3g} across may have been missed" in str(found.stop)
    assert found.atlas.free_disc().diameter == pytest.approx(disc.diameter, rel=0.05)


def test_the_centre_of_the_largest_disc_is_touched_and_no_place_twice():
    obj = make_object("sphere")
    atlas = learned(spread_touches(obj, 8), obj.tolerance)
    places, tried = places_of(atlas), Attempts(np.zeros(3), np.array([0.0, 0.0, 1.0]))

    def target(feature):
        options = PlannerOptions(feature=feature)
        return missed_feature(View(atlas, options, tried, Phase.FINISH), places)

    largest = free_disc(View(atlas, PlannerOptions(), tried), places)
    assert target(0.0) is None and target(1.1 * largest.diameter) is None
    first = target(0.5 * largest.diameter)
    assert first.point == pytest.approx(largest.centre)
    tried.tried.append(first.point)
    second = target(0.5 * largest.diameter)
    assert second is None or np.linalg.norm(second.point - first.point) > 0.25 * largest.diameter


@pytest.mark.slow
def test_exploring_goes_on_until_no_disc_of_the_feature_is_free():
    obj = make_object("bottle")
    found = explore_body(obj, 60, options=PlannerOptions(feature=20.0))
    assert found.stop.reason is StopReason.KNOWN and found.stop.free_disc.diameter < 20.0
    points = obj.sample(20_000, np.random.default_rng(1))[0]
    assert 2.0 * found.atlas.body.away(points).max() < 1.05 * 20.0
