"""Residuals: detail finer than the patches, on a ball with bumps a fifth of a patch wide."""

import numpy as np
import pytest

from tests.explored import BUMPY_FREQUENCY, BUMPY_HEIGHT, BUMPY_RADIUS, bumpy, touched_again


@pytest.fixture(scope="module")
def ball():
    return bumpy()


def test_residuals_explain_bumps_finer_than_patches(ball):
    """At vertices of the bumpy ball, where the polynomials alone err by a third of the bumps."""
    after = ball.atlas.blend(ball.points)
    assert ball.count > 0.8 * len(ball.atlas) and after.known.mean() > 0.95
    assert np.nanmean(np.abs(after.distance)) < 0.6 * np.nanmean(ball.before)
    held = np.abs(after.distance) <= 1.96 * after.deviation
    assert np.mean(held[after.known]) > 0.8


def test_learning_residuals_again_changes_nothing():
    """The trends are solved anew from the same sums first: equal but for rounding."""
    ball = bumpy()
    before = ball.atlas.blend(ball.points).distance
    assert ball.atlas.learn_residuals() == ball.count
    after = ball.atlas.blend(ball.points).distance
    assert after == pytest.approx(before, abs=1e-6, nan_ok=True)


def test_blend_gradient_with_residuals_is_its_normal(ball):
    """The two differ by two terms. Off the surface the distance is of first order: its gradient
    errs by twice the distance times the curvature, at most a f^2 for bumps of height a and
    frequency f. And weights change: by some 4 over the patch radius, as on the smooth ball, and by
    2 over the correlation length, on which the variance changes; times what the patches disagree
    by. In nine of ten places they disagree by less than two deviations."""
    atlas, points, h = ball.atlas, ball.points, 1e-3
    seen = atlas.blend(points)
    sides = [
        atlas.blend(points + h * e).distance - atlas.blend(points - h * e).distance
        for e in np.eye(3)
    ]
    error = np.linalg.norm(np.stack(sides, axis=1) / (2.0 * h) - seen.normal, axis=1)
    curvature = BUMPY_HEIGHT * BUMPY_RADIUS * BUMPY_FREQUENCY**2
    radius = min(atlas.patch(i).radius for i in atlas.graph)
    change = 4.0 / radius + 2.0 / atlas.residual_scale.length
    limit = 2.0 * np.abs(seen.distance) * curvature + 2.0 * seen.deviation * change
    assert np.nanquantile(error / limit, 0.9) < 1.0


def test_an_atlas_with_residuals_goes_on_learning():
    """The equations hold what a residual explains as lack of fit: touches are added to them as
    before."""
    ball, rng = bumpy(), np.random.default_rng(0)
    ball.atlas.validate()
    for touch in ball.touches[:5]:
        change = ball.atlas.add(touched_again(touch, rng))
        assert not change.refused
        ball.atlas.validate()
    ball.atlas.refit_all()
    ball.atlas.validate()
    assert ball.atlas.learn_residuals()
    ball.atlas.validate()
