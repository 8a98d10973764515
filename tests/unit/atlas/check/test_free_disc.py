"""The largest disc without a sample: closed forms, brute force, thin walls."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.check.free_disc import FreeDisc, feature_doubts, largest_free_disc

# To which the largest disc is found.
NEARLY = 0.01


def test_a_ball_with_samples_at_the_corners_of_an_octahedron():
    """The middle of an octant is arccos(1/sqrt 3) = 54.7 degrees from three samples: a chord of
    2 sin 27.4 degrees. Triangles lie within a thousandth of the ball."""
    ball = trimesh.creation.icosphere(5)
    samples = np.concatenate([np.eye(3), -np.eye(3)])
    found = largest_free_disc(ball.triangles, samples, samples)
    chord = 2.0 * np.sin(0.5 * np.arccos(1.0 / np.sqrt(3.0)))
    assert found.diameter == pytest.approx(2.0 * chord, rel=NEARLY)
    assert np.abs(found.centre) == pytest.approx(np.full(3, 1.0 / np.sqrt(3.0)), abs=0.05)
    assert found.normal == pytest.approx(found.centre, abs=0.05)


def test_it_is_the_covering_radius_by_brute_force():
    """Against 20,000 points drawn on the surface, the nearest sample of each; they miss the centre
    by a mean distance of sqrt(area / points)."""
    box = trimesh.creation.box((3.0, 2.0, 1.0))
    samples, of = trimesh.sample.sample_surface(box, 60, seed=1)
    normals = box.face_normals[of]
    found = largest_free_disc(box.triangles, samples, normals)
    points, of = trimesh.sample.sample_surface(box, 20_000, seed=2)
    facing = normals @ box.face_normals[of].T >= -0.5
    away = np.full(len(points), np.inf)
    for sample, sees in zip(samples, facing, strict=True):
        own = np.linalg.norm(points - sample, axis=1)
        away = np.where(sees, np.minimum(away, own), away)
    assert found.diameter / 2.0 == pytest.approx(
        away.max(), abs=NEARLY * away.max() + 2.0 * np.sqrt(box.area / 20_000)
    )


def test_samples_on_the_far_side_of_a_wall_are_not_in_a_disc():
    """A wall of 0.01 and a square of 2, with samples all over the lower side and at the corners of
    the upper one."""
    x, y = np.meshgrid(np.linspace(0.0, 2.0, 21), np.linspace(0.0, 2.0, 21))
    lower = np.stack([x, y, np.full_like(x, -0.01)], axis=2).reshape(-1, 3)
    upper = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    points = np.concatenate([lower, upper])
    normals = np.concatenate([np.tile([0.0, 0, -1], (441, 1)), np.tile([0.0, 0, 1], (4, 1))])
    found = largest_free_disc(upper[[[0, 1, 2], [0, 2, 3]]], points, normals)
    assert found.diameter == pytest.approx(2.0 * np.sqrt(2.0), rel=NEARLY)


def test_motion_and_scale_carry_the_disc_along():
    ball = trimesh.creation.icosphere(2)
    samples = np.random.default_rng(3).normal(size=(20, 3))
    samples /= np.linalg.norm(samples, axis=1)[:, None]
    turn = trimesh.transformations.rotation_matrix(0.7, [0.1, 0.5, 0.9])[:3, :3]
    here = largest_free_disc(ball.triangles, samples, samples)
    there = largest_free_disc(
        1e3 * ball.triangles @ turn.T + 5.0, 1e3 * samples @ turn.T + 5.0, samples @ turn.T
    )
    assert there.diameter == pytest.approx(1e3 * here.diameter, rel=1e-9)
    assert there.centre == pytest.approx(1e3 * turn @ here.centre + 5.0, abs=1e-6)


def test_no_triangles_have_no_disc():
    none = np.zeros((0, 3, 3))
    assert largest_free_disc(none, np.eye(3), np.eye(3)) is None


def test_a_feature_that_was_asked_for_is_doubted_where_it_may_be_missed():
    numbers = {"free_disc": 9.0, "free_disc_place": [1.0, 2.0, 3.0], "feature": 8.0}
    [doubt] = feature_doubts(numbers)
    assert doubt.name == "missed feature" and "up to 9 across" in doubt.words
    assert doubt.places.tolist() == [[1.0, 2.0, 3.0]]
    assert not feature_doubts(numbers | {"feature": 0.0})
    assert not feature_doubts(numbers | {"feature": 9.5})
    assert "up to 4 across" in FreeDisc(np.zeros(3), np.zeros(3), 4.0).words
