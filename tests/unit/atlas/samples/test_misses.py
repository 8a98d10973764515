"""Deviations where a face may end unseen: their intervals hold 95 % of simulated errors."""

import numpy as np
import pytest

from touchatlas.atlas.samples.misses import deviation_with_misses, misses_of
from touchatlas.patch.geometry.normal_error import SURE


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
    row = misses_of(seen, np.full(len(seen), 0.01), away)
    later, away = errors(rng, 20000, rate, 0.01, 3.0)
    deviation = deviation_with_misses(np.full(len(later), 0.01), away, row[None])
    held = np.abs(later) <= SURE * deviation
    assert held.mean() == pytest.approx(0.95, abs=0.01)
    far = away > 1.5
    assert held[far].mean() == pytest.approx(0.95, abs=0.02)


def test_faces_that_never_missed_keep_their_deviations():
    deviation = np.array([0.1, 0.2])
    none = np.array([[0.0, 10.0, 0.0]])
    assert np.array_equal(deviation_with_misses(deviation, np.ones(2), none), deviation)
    assert np.array_equal(deviation_with_misses(deviation, np.ones(2), np.zeros((0, 3))), deviation)


def test_at_a_sample_a_face_keeps_its_deviation_and_far_away_it_has_that_of_misses():
    """The bracket is halved thirty times: 1e-9 of its width."""
    found = deviation_with_misses([0.1, 0.1], np.array([0.0, 1e6]), [[5.0, 10.0, 5.0 * 9.0]])
    assert found == pytest.approx([0.1, 3.0], abs=1e-8)


def test_deviations_with_misses_scale_with_the_unit():
    """Powers of two scale without rounding."""
    deviation, away, row = np.array([0.1, 0.3]), np.array([2.0, 7.0]), np.array([[3.0, 40.0, 27.0]])
    once = deviation_with_misses(deviation, away, row)
    scaled = deviation_with_misses(4.0 * deviation, 4.0 * away, row * [1.0, 4.0, 16.0])
    assert np.array_equal(scaled, 4.0 * once)
