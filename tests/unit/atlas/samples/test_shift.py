"""A shift of the object between touches: what samples of several faces say of it."""

import numpy as np
import pytest

from touchatlas.atlas.samples.shift import Shift, shift_of


def test_a_shift_is_found_among_samples_of_other_faces():
    """Normals all around; a fifth of the samples lie on a face that was not known."""
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    true = np.array([0.3, -0.1, 0.2])
    distance = normals @ true + 0.02 * rng.normal(size=200)
    distance[:40] += 5.0
    found = shift_of(distance, normals, np.full(200, 0.02**2), 7.0)
    assert found.most_probable == pytest.approx(true, abs=0.01)
    assert found.left(found.most_probable) < 0.2 * found.square
    assert shift_of(distance[:0], normals[:0], distance[:0], 7.0).square == 0.0


def test_a_step_that_no_contour_has_crossed_tells_no_shift():
    """As beside the lower level of a plate: of ten samples on level ground three lie where the
    surface is, and a shift would move all; of samples on the side wall it moves none."""
    up, side = np.tile([0.0, 0.0, 1.0], (10, 1)), np.tile([0.0, 1.0, 0.0], (10, 1))
    lower = np.where(np.arange(10) < 7, -0.66, 0.01)
    none, variance = np.zeros(10), np.full(20, 0.02**2)
    for ground, tells in (lower, False), (np.full(10, -0.66), True):
        distance = np.concatenate([ground, none])
        found = shift_of(distance, np.concatenate([up, side]), variance, 7.0)
        assert (found.square > 0.0) == tells


def test_one_contour_alone_tells_no_shift():
    """Of three contours with normals of all directions, one has two samples that the surface
    misses by twenty deviations: some shift explains these. A shift is seen by all three."""
    rng, contours = np.random.default_rng(5), np.repeat([0, 1, 2], [6, 4, 2])
    normals = np.tile([0.0, 1.0, 0.0], (12, 1))
    normals[6:10], normals[10:] = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
    noise, variance = 0.02 * rng.normal(size=12), np.full(12, 0.02**2)
    missed, shift = np.where(contours == 2, 0.4, 0.0), np.array([0.3, 0.3, 0.3])
    for off, tells in (missed, False), (normals @ shift, True):
        found = shift_of(off + noise, normals, variance, 7.0, contours=contours)
        assert (found.square > 0.0) == tells
    # Without contours both do.
    assert shift_of(missed + noise, normals, variance, 7.0).square > 0.0


def test_shifts_of_touches_add_up():
    one = Shift(np.diag([4.0, 0.0, 0.0]), np.array([2.0, 0.0, 0.0]), 1.0)
    other = Shift(np.diag([0.0, 1.0, 0.0]), np.array([0.0, 3.0, 0.0]), 9.0)
    assert (one + other).most_probable == pytest.approx([0.5, 3.0, 0.0])
    assert (one + other).left((one + other).most_probable) == pytest.approx(0.0)
