"""The blended distance against its own finite differences."""

import numpy as np
import pytest

from tests.explored import explored


def test_gradient_of_the_distance_is_the_normal():
    """On the surface the two differ by how fast the weights of patches that disagree change: their
    gaps, a noise or so, times some 4 over the patch radius. Off it the distance is of first
    order, and its gradient errs by twice the distance times the curvature."""
    atlas, h, ball = explored("sphere").atlas, 1e-4, 33.0
    points = np.random.default_rng(0).normal(size=(300, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    patches = [atlas.patch(i) for i in atlas.graph]
    disagreement = 4.0 * max(p.noise_std for p in patches) / min(p.radius for p in patches)
    for off in (-0.3, -0.05, 0.0, 0.05, 0.3):
        at = points * (ball + off)
        sides = [
            atlas.blend(at + h * e).distance - atlas.blend(at - h * e).distance for e in np.eye(3)
        ]
        error = np.stack(sides, axis=1) / (2.0 * h) - atlas.blend(at).normal
        limit = disagreement + 2.0 * abs(off) / ball
        assert np.linalg.norm(error, axis=1).max() < limit


def test_what_is_no_array_of_points_is_refused():
    atlas = explored("torus", max_touches=25).atlas
    for points in (np.full((1, 3), np.nan), np.zeros(3), np.zeros((2, 2))):
        with pytest.raises(ValueError, match="points"):
            atlas.blend(points)
    assert len(atlas.blend(np.zeros((0, 3))).distance) == 0
