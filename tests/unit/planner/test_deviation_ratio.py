"""DeviationRatio: errors over predicted deviations, from the samples of the last touches."""

import numpy as np
import pytest
from scipy.special import erfinv

from tests.explored import learned as learned_from
from tests.explored import spread_touches
from touchatlas.atlas import Atlas
from touchatlas.atlas.learn import innovations
from touchatlas.planner.known import DeviationRatio
from touchatlas.sim import make_object


def learned(*parts) -> DeviationRatio:
    ratio = DeviationRatio()
    for part in parts:
        ratio.learn(np.asarray(part))
    return ratio


def factor_of(ratio: DeviationRatio) -> float:
    """By what predicted deviations are multiplied, from the chance of one of them."""
    return float(1.0 / (np.sqrt(2.0) * erfinv(ratio.within(1.0))))


def test_without_samples_predictions_are_taken_as_they_are():
    """The 95 % quantile of 150 points of a normal distribution is off by a percent."""
    assert factor_of(learned()) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("factor", [1.2, 2.0])
def test_errors_that_are_so_many_times_larger_are_found(factor):
    """Of 8,000 samples the 95 % quantile has a relative standard error of 0.012 (its density is
    0.12 there); the 150 samples that come before all move it by less than 0.03."""
    draws = factor * np.random.default_rng(0).normal(size=(8, 1000))
    assert factor_of(learned(*draws)) == pytest.approx(factor, rel=0.06)


def test_smaller_errors_are_not_believed():
    assert factor_of(learned(*np.full((8, 100), 0.1))) == pytest.approx(1.0, rel=1e-12)


def test_a_few_samples_of_a_wrong_patch_change_little():
    draws = 2.0 * np.random.default_rng(1).normal(size=(8, 100))
    wrong = draws.copy()
    wrong[:, :2] = 1e3
    assert factor_of(learned(*wrong)) < 1.2 * factor_of(learned(*draws))


def test_only_the_last_eight_touches_count_and_empty_ones_do_not():
    early, late = np.full((5, 100), 7.0), np.full((8, 100), 3.0)
    assert learned(*early, *late).within(2.0) == learned(*late).within(2.0)
    assert learned(*late, [], [], []).within(2.0) == learned(*late).within(2.0)


@pytest.fixture(scope="module")
def touches():
    body = make_object("blob")
    return spread_touches(body, 6, body.noise_std)


def points_of(touch) -> np.ndarray:
    return np.concatenate([contour.points for contour in touch.contours])


def test_the_change_of_a_touch_tells_what_was_predicted_before_it(touches):
    atlas = Atlas(0.1)
    assert not len(atlas.add(touches[0]).innovations)
    for touch in touches[1:]:
        before = innovations(atlas, points_of(touch), atlas.sample_std)
        assert (atlas.add(touch).innovations == before).all()


def test_innovations_are_distances_over_the_deviation_of_prediction_and_sample(touches):
    """Second route: sample by sample from the blend, in the places where it knows enough."""
    *first, last = touches
    atlas = learned_from(first, 0.1)
    found, expected = atlas.blend(points_of(last)), []
    for known, distance, deviation in zip(
        found.known, found.distance, found.deviation, strict=True
    ):
        if known and atlas.sample_std <= deviation <= 4.0 * atlas.scale:
            expected.append(distance / np.hypot(deviation, atlas.sample_std))
    assert len(expected) > 10
    found_again = innovations(atlas, points_of(last), atlas.sample_std)
    assert found_again == pytest.approx(np.array(expected), rel=1e-12)


def test_where_one_law_holds_all_known_samples_tell():
    """Its surface is so much surer than a sample that samples tell whether it holds: their squares
    have a mean of 1 and a variance of 2."""
    ball = make_object("sphere")
    *first, last = spread_touches(ball, 6, ball.noise_std)
    atlas = learned_from(first, 0.1)
    found = innovations(atlas, points_of(last), atlas.sample_std)
    assert len(found) == atlas.blend(points_of(last)).known.sum() > 20
    assert np.mean(found**2) == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / len(found)))


def test_where_all_errors_are_larger_the_chance_is_that_of_the_larger_deviation():
    draws = 2.0 * np.random.default_rng(2).normal(size=(8, 1000))
    found = learned(*draws).within(np.array([2.0, 4.0]))
    # The normal law holds 68.3 and 95.4 % within one and two deviations. The ratio is 2 to 3 %.
    assert found == pytest.approx([0.683, 0.954], abs=0.02)


def test_where_some_patches_are_wrong_the_others_count_as_known():
    """A fifth of the samples lies anywhere. A place that is known to a quarter of the tolerance is
    within it with a chance of 0.8, not with that of a ratio of hundreds."""
    draws = np.random.default_rng(3).normal(size=(8, 1000))
    draws[:, :200] *= 1e3
    ratio = learned(*draws)
    # 150 right samples come before the 8,000: a fiftieth of a fifth.
    assert ratio.within(4.0) == pytest.approx(0.8, abs=0.01)
