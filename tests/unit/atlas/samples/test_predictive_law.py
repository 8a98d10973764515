"""PredictiveLaw: laws of errors are found from simulated innovations, and hold their intervals."""

import numpy as np
import pytest
from scipy.stats import t as student

from tests.explored import learned as learned_from
from tests.explored import spread_touches
from touchatlas.atlas import Atlas
from touchatlas.atlas.learn import innovations
from touchatlas.atlas.samples.predictive_law import (
    LATEST,
    LawPrior,
    PredictiveLaw,
    deviation_with_misses,
    error_law_of,
    innovations_of,
)
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim import make_object

STD = 0.01
NOISE = STD / np.sqrt(2.0)
NOISE_OF_BLOB = make_object("blob").noise_std


def simulated(rng, law: PredictiveLaw, count: int = 200, touches: int = LATEST):
    """Innovations of touches whose errors obey a law, with noise."""
    parts = []
    for number in range(touches):
        deviation = STD * rng.uniform(0.2, 10.0, count)
        error = law.scale(deviation) * rng.standard_t(law.freedom, count)
        distance = error + NOISE * rng.normal(size=count)
        parts.append(innovations_of(number, distance, deviation, NOISE, STD, 1.0))
    return np.concatenate(parts)


def test_the_chance_of_an_error_is_that_of_a_student_t():
    """Second route: scipy.stats. The scale of a deviation of 0.3 is √(0.24² + 0.1²) = 0.26."""
    law = PredictiveLaw(5.0, 0.8, 0.1)
    found = law.chance(0.5, np.array([0.3]), 0.0)
    assert found == pytest.approx(2.0 * student.cdf(0.5 / 0.26, 5.0) - 1.0, rel=1e-12)
    assert law.chance(SURE * law.deviations(0.3), 0.3, 0.0) == pytest.approx(0.95, rel=1e-9)


def test_without_samples_the_law_is_the_prior():
    found, prior = error_law_of(np.zeros((0, 6)), STD), LawPrior()
    assert (found.freedom, found.factor, found.floor) == (prior.freedom, prior.factor, 0.0)
    # The lattice ends at three and four standard deviations.
    assert found.spread == pytest.approx(prior.factor_spread, rel=0.01)


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.4])
def test_errors_so_many_times_the_predicted_ones_are_found(factor):
    """Five independent samples of each of eight touches tell a scale to an eighth, and the prior,
    of a spread of 0.2, moves it by as much: three of both, for six draws."""
    rng = np.random.default_rng(0)
    found = [
        error_law_of(simulated(rng, PredictiveLaw(30.0, factor)), STD).factor for _ in range(6)
    ]
    assert np.mean(np.log(found)) == pytest.approx(np.log(factor), abs=0.3)


@pytest.mark.parametrize(
    "law",
    [PredictiveLaw(3.0, 0.7), PredictiveLaw(7.0, 0.5, 0.004), PredictiveLaw(30.0, 1.2, 0.004)],
)
def test_intervals_hold_95_percent_of_later_errors(law):
    """In each third of the predicted deviation. Forty samples tell a scale to an eighth: intervals
    that are so much too short or long hold 0.91 to 0.97 of normal errors, and the prior adds as
    much again."""
    rng = np.random.default_rng(1)
    found = error_law_of(simulated(rng, law), STD)
    deviation = STD * rng.uniform(0.2, 10.0, 30000)
    error = np.abs(law.scale(deviation) * rng.standard_t(law.freedom, 30000))
    held = error <= SURE * found.deviations(deviation)
    for third in np.array_split(np.argsort(deviation), 3):
        assert 0.88 < held[third].mean() < 0.995


def test_a_few_samples_of_a_wrong_face_leave_the_others_known():
    """Two of a hundred lie anywhere: they tell a rate, and the law of the others stays, to a step
    of 0.15 of the lattice of logarithms."""
    rng = np.random.default_rng(2)
    right = simulated(rng, PredictiveLaw(), 100)
    wrong = right.copy()
    wrong[::50, 1] = 100.0
    here, there = error_law_of(right, STD), error_law_of(wrong, STD)
    assert abs(np.log(there.factor / here.factor)) < 0.16 and there.floor == here.floor
    # Sixteen of 800, each 1.0 away from the nearest sample.
    assert there.rate == pytest.approx(0.02, rel=1e-12) and here.rate == 0.0
    assert there.chance(1.0, 0.0, 0.5) == pytest.approx(np.exp(-0.01), rel=1e-9)


def test_one_free_form_face_does_not_end():
    wrong = simulated(np.random.default_rng(3), PredictiveLaw(), 100)
    wrong[::50, 1] = 100.0
    assert error_law_of(wrong, STD, of_faces=False).rate == 0.0


def test_a_law_scales_with_the_unit():
    """Powers of two scale without rounding."""
    seen = simulated(np.random.default_rng(4), PredictiveLaw(5.0, 1.0, 0.01))
    seen[::50, 1] = 100.0
    scaled = seen * [1.0, 4.0, 4.0, 4.0, 4.0, 4.0]
    once, other = error_law_of(seen, STD), error_law_of(scaled, 4.0 * STD)
    assert (other.freedom, other.factor) == (once.freedom, once.factor)
    assert other.floor == 4.0 * once.floor and other.rate == once.rate / 4.0
    assert np.array_equal(
        deviation_with_misses([0.4, 1.2], np.array([8.0, 28.0]), scaled),
        4.0 * deviation_with_misses([0.1, 0.3], np.array([2.0, 7.0]), seen),
    )


def errors(rng, count, rate, std, size):
    """Errors (n,) of a face that ends at a Poisson rate (1/length), at distances (n,) from
    samples."""
    away = rng.uniform(0.0, 2.0, count)
    ends = rng.exponential(1.0 / rate, count) < away
    return np.where(ends, rng.normal(0.0, size, count), rng.normal(0.0, std, count)), away


@pytest.mark.parametrize("rate", [0.01, 0.05, 0.1])
def test_intervals_hold_95_percent_of_the_errors_of_faces_that_end_at_random(rate):
    """Rate and size are learned from 20,000 errors, some 200 misses at the least: 7 % of 5 %. Of
    20,000 more, chance moves the share by 0.0015; that at a distance, by 0.005."""
    rng = np.random.default_rng(1)
    seen, away = errors(rng, 20000, rate, 0.01, 3.0)
    row = innovations_of(0, seen, 0.01, 0.0, 0.0, away)
    later, away = errors(rng, 20000, rate, 0.01, 3.0)
    deviation = deviation_with_misses(np.full(len(later), 0.01), away, row)
    held = np.abs(later) <= SURE * deviation
    assert held.mean() == pytest.approx(0.95, abs=0.01)
    far = away > 1.5
    assert held[far].mean() == pytest.approx(0.95, abs=0.02)


def test_faces_that_never_missed_keep_their_deviations():
    deviation, right = np.array([0.1, 0.2]), innovations_of(0, [0.0], 0.1, 0.1, 0.1, 10.0)
    for none in right, np.zeros((0, 6)):
        assert np.array_equal(deviation_with_misses(deviation, np.ones(2), none), deviation)


def test_at_a_sample_a_face_keeps_its_deviation_and_far_away_it_has_that_of_misses():
    """The bracket is halved thirty times: 1e-9 of its width."""
    missed = innovations_of(0, np.full(5, 3.0), 0.1, 0.0, 0.0, 2.0)
    found = deviation_with_misses([0.1, 0.1], np.array([0.0, 1e6]), missed)
    assert found == pytest.approx([0.1, 3.0], abs=1e-8)


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
        before = innovations(atlas, points_of(touch), NOISE_OF_BLOB)
        assert (atlas.add(touch).innovations == before).all()


def test_innovations_are_what_the_surface_says_of_samples_where_it_knows_enough(touches):
    """Second route: sample by sample from the blend, whose deviations are those of the law."""
    *first, last = touches
    atlas = learned_from(first, 0.1)
    found = atlas.blend(points_of(last))
    seen = innovations(atlas, points_of(last), NOISE_OF_BLOB)
    known = found.distance[found.known]
    rows = np.flatnonzero(np.isin(known, seen[:, 1]))
    assert len(rows) == len(seen) > 10
    told = atlas.law.deviations(seen[:, 2])
    assert found.deviation[found.known][rows] == pytest.approx(told, rel=1e-12)


def test_only_the_last_eight_touches_count(touches):
    atlas = Atlas(0.1)
    for number in range(12):
        first = len(atlas.pool)
        atlas.pool.add(*np.zeros((3, 2, 3)), False, 0.1, touches=number)
        atlas.learn_innovations(innovations_of(first, [0.0, 0.1], 0.1, 0.1, 0.1, 1.0))
    assert np.unique(atlas.innovations[:, 0]).tolist() == list(range(8, 24, 2))


def test_errors_of_one_face_are_forgotten_when_it_becomes_six():
    """A box that begins as one face: what was learned of that says nothing of six faces."""
    atlas = learned_from(spread_touches(make_object("cube"), 9), 0.1)
    assert atlas.settled > 0
    assert (atlas.innovations[:, 0] < atlas.settled).any()


def test_outliers_at_samples_tell_no_rate_of_faces_that_end():
    """No face ends within a distance of zero: chance and intervals are those of a rate of zero, to
    the billionth of a bracket of nine that bisection leaves."""
    found = error_law_of(innovations_of(0, np.full(5, 10.0), 0.1, STD, STD, 0.0), STD)
    assert found.rate == 0.0 and np.isfinite(found.chance(1.0, [0.1], [0.0])).all()
    missed = innovations_of(0, np.full(5, 10.0), 0.1, STD, STD, 0.0)
    found = deviation_with_misses([1.0, 2.0], np.array([0.0, 1.0]), missed)
    assert np.allclose(found, [1.0, 2.0], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(("deviation", "inside"), [(0.0, 0.95), (np.inf, 0.0)])
def test_an_error_that_all_share_adds_to_none_and_to_any(deviation, inside):
    """Without another error the law is the normal one; what is not known at all stays so."""
    law = PredictiveLaw(systematic=0.5)
    assert law.chance(1.96 * 0.5, [deviation], [0.0])[0] == pytest.approx(inside, abs=1e-4)
