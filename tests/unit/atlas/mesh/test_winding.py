"""Winding numbers do not depend on where a mesh is."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.mesh.winding import winding_numbers


@pytest.mark.parametrize("away", [0.0, 1e5, 1e7, 1e9])
def test_points_are_in_a_ball_however_far_it_is_from_the_origin(away):
    """The distance from the middle tells the side of points that are a hundredth of the radius off;
    coordinates of 1e9 are known to 1e-7. The triangles of a ball lie up to 0.1 % of its radius
    inside of it."""
    rng = np.random.default_rng(0)
    ball = trimesh.creation.icosphere(4, 12.0)
    direction = rng.normal(size=(2000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = 12.0 * np.where(rng.random(2000) < 0.5, 0.99, 1.01)
    shift = away * np.array([1.0, -0.5, 0.25])
    found = winding_numbers(ball.vertices + shift, ball.faces, radius[:, None] * direction + shift)
    assert np.array_equal(found > 0.5, radius < 12.0)
