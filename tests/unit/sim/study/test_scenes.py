"""Scenes for one patch: exact where they must be, noisy as they say."""

import numpy as np
import pytest

from touchatlas.sim.study.scenes import SURFACES, draw_scene


def scene_of(surface, noise_std=0.0, tilt=0.0, seed=0, **options):
    return draw_scene(surface, noise_std, tilt, np.random.default_rng(seed), **options)


def offsets(scene, points):
    """Signed first-order distances from the surface."""
    value, gradient, _ = scene.surface.field(points)
    return value / np.linalg.norm(gradient, axis=1)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_points_lie_on_the_surface(surface, tilt):
    scene = scene_of(surface, tilt=tilt)
    points = np.concatenate(
        [scene.point[None], scene.verifying, *(c.points for c in scene.contours)]
    )
    assert np.abs(offsets(scene, points)).max() <= 1e-9 * np.ptp(points, axis=0).max()


@pytest.mark.parametrize("surface", SURFACES)
def test_a_scene_has_the_points_of_the_paper(surface):
    scene = scene_of(surface)
    assert [c.points.shape for c in scene.contours] == [(19, 3)] * 3
    assert scene.verifying.shape == (171, 3)
    steps = np.linalg.norm(np.diff(scene.contours[0].points, axis=0), axis=1)
    # Chords of arcs that turn by 5 degrees.
    assert steps == pytest.approx(scene.reach / 9, rel=2e-3)


@pytest.mark.parametrize("surface", SURFACES)
def test_planes_lean_as_far_as_they_are_told(surface):
    scene = scene_of(surface, tilt=0.5)
    leans = [abs(np.arcsin(c.plane.normal @ scene.normal)) for c in scene.contours]
    assert 0.0 < max(leans) <= 0.5
    for contour in scene.contours:
        across = (contour.points - scene.point) @ contour.plane.normal
        assert np.abs(across).max() <= 1e-9 * scene.reach


@pytest.mark.parametrize("surface", SURFACES)
def test_curvatures_match_finite_differences_of_sections(surface):
    scene = scene_of(surface, seed=3, reach=0.02, points=1)
    ahead, behind = scene.verifying[2::3], scene.verifying[0::3]
    rise = (ahead + behind - 2.0 * scene.point) @ scene.normal
    curvature = rise / np.linalg.norm(0.5 * (ahead - behind), axis=1) ** 2
    # Of even sections: H + b cos 2a + c sin 2a.
    mean = curvature.mean()
    half = np.sqrt(2.0 * np.mean((curvature - mean) ** 2))
    # Rounding of coordinates of 100 over steps of 0.02.
    assert [mean + half, mean - half] == pytest.approx([scene.k1, scene.k2], abs=2e-7, rel=1e-4)


def test_noise_has_its_standard_deviation():
    noise, errors = 0.03, []
    for seed in range(10):
        exact, noisy = scene_of("torus", seed=seed), scene_of("torus", noise, seed=seed)
        assert np.array_equal(exact.verifying, noisy.verifying)
        errors.append((noisy.contact - noisy.point)[None])
        for a, b in zip(exact.contours, noisy.contours, strict=True):
            assert b.noise_std == noise
            errors.append(b.points - a.points)
    found = np.concatenate(errors)
    # Four standard errors of a standard deviation.
    assert found.std() == pytest.approx(noise, rel=4.0 / np.sqrt(2.0 * found.size))
    assert np.abs(found.mean(axis=0)).max() < 4.0 * noise / np.sqrt(len(found))


def test_one_seed_gives_one_scene():
    first, second = scene_of("mouse", 0.02, 0.5), scene_of("mouse", 0.02, 0.5)
    assert np.array_equal(first.contours[2].points, second.contours[2].points)
    assert not np.array_equal(first.point, scene_of("mouse", 0.02, 0.5, seed=1).point)


def test_an_unknown_surface_is_refused():
    with pytest.raises(ValueError, match="'cup' is no surface"):
        scene_of("cup")
