"""Contours of unequal lengths, off the point, more of them, or with bad contacts."""

from dataclasses import replace

import numpy as np
import pytest

from tests.laws.patch_scenes import NOISE, SMOOTH_SURFACES, contours_of, fit_of, scene_of
from tests.truths import UP, ball_height
from touchatlas.patch import Contour, PatchFit, SamplingPlane, fit_patch
from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.sim.study.scenes import Scene


@pytest.mark.parametrize("surface", SMOOTH_SURFACES)
def test_shared_contacts_lower_the_deviation(surface):
    """Forty more of them, at random between the curves, on each of three patches."""
    for draw in range(3):
        rng, scene = np.random.default_rng([3, draw]), scene_of(surface, draw)
        shared = scene.verifying[rng.choice(len(scene.verifying), 40, replace=False)]
        shared = shared + NOISE * rng.normal(size=shared.shape)
        alone = fit_of(scene).patch.deviation(scene.verifying)
        together = fit_of(scene, shared=shared).patch.deviation(scene.verifying)
        assert together.mean() < alone.mean()


def missing_the_point(scene: Scene, rng) -> tuple[Contour, ...]:
    """Curves in planes that are shifted by up to 5 % of the reach, so that no three meet."""
    return tuple(
        shifted(scene, contour, 0.05 * scene.reach * rng.uniform(-1.0, 1.0), rng)
        for contour in scene.contours
    )


def shifted(scene: Scene, contour: Contour, offset: float, rng) -> Contour:
    across = contour.plane.normal
    points = contour.points + offset * across
    for _ in range(20):
        value, gradient, _ = scene.surface.field(points)
        within = gradient - (gradient @ across)[:, None] * across
        points = points - (value / (within**2).sum(axis=1))[:, None] * within
    plane = SamplingPlane(contour.plane.point + offset * across, across)
    points = points + scene.noise_std * rng.normal(size=points.shape)
    return Contour(points, plane, scene.noise_std, contour.ends)


def parts_of(scene: Scene, parts) -> tuple[Contour, ...]:
    return tuple(
        Contour(c.points[part], c.plane, c.noise_std, c.ends)
        for c, part in zip(scene.contours, parts, strict=True)
    )


UNEVEN = {
    "as they should be": lambda scene, rng: scene.contours,
    "missing the point": missing_the_point,
    "unequal numbers": lambda s, rng: parts_of(s, (slice(None), slice(0, 19, 2), slice(0, 19, 3))),
    "unequal arms": lambda s, rng: parts_of(s, (slice(None), slice(3, None), slice(0, 14))),
}


def error_in_deviations(fit: PatchFit, scene: Scene) -> float:
    """Root mean square of error over predicted deviation, over verifying points in the radius."""
    patch = fit.patch
    near = np.linalg.norm(scene.verifying - patch.frame.origin, axis=1) <= patch.radius
    points = scene.verifying[near]
    return float(np.sqrt(np.mean((patch.signed_distance(points) / patch.deviation(points)) ** 2)))


@pytest.mark.parametrize("situation", UNEVEN)
@pytest.mark.parametrize("surface", SMOOTH_SURFACES)
def test_error_stays_within_three_deviations_however_curves_run(surface, situation):
    for draw in range(3):
        rng, scene = np.random.default_rng([4, draw]), scene_of(surface, draw)
        assert error_in_deviations(fit_of(scene, UNEVEN[situation](scene, rng)), scene) < 3.0


@pytest.mark.parametrize("sections", [4, pytest.param(5, marks=pytest.mark.slow), 6])
@pytest.mark.parametrize("surface", [*SMOOTH_SURFACES, "torus"])
def test_error_stays_within_three_deviations_with_more_curves(surface, sections):
    for draw in range(3):
        scene = scene_of(surface, draw, sections)
        assert error_in_deviations(fit_of(scene), scene) < 3.0


@pytest.mark.parametrize("place", [0, 1, 5, 9, 18])
def test_one_bad_contact_is_left_out_wherever_it_is(place):
    """Fifty deviations off: the last point of a curve of degree 6 is predicted to about seven; at
    the reference point, the ninth, neighbours outvote it."""
    contours = contours_of(ball_height, 15.0, 3, NOISE, points=19)
    points = contours[1].points.copy()
    points[place, 2] += 50.0 * NOISE
    spoilt = (contours[0], replace(contours[1], points=points), contours[2])
    clean, fit = fit_patch(np.zeros(3), contours, UP), fit_patch(np.zeros(3), spoilt, UP)
    assert (clean.outliers, fit.outliers) == (0, 1)
    # One of 57 samples less moves the patch by less than the noise of one.
    where = clean.patch.frame.to_world(5.0 * np.eye(3)[:2])
    moved_by = clean.patch.signed_distance(where) - fit.patch.signed_distance(where)
    assert np.abs(moved_by).max() < NOISE


def test_good_contacts_are_kept():
    """Five deviations, of Student's law with 11 degrees of freedom at worst: 4e-4 a sample. Of
    3,420 samples one or two may go; five would be one chance in a hundred."""
    dropped = sum(
        len(c.points) - len(without_bad_contacts(c).points)
        for seed in range(60)
        for c in contours_of(ball_height, 15.0, 3, NOISE, seed, 19)
    )
    assert dropped < 5


def test_exact_curves_that_no_polynomial_holds_are_kept():
    contours = contours_of(lambda x, y: 0.5 * np.sin(x / 3.0) + 0.0 * y, 15.0, 3, points=19)
    assert fit_patch(np.zeros(3), contours, UP).outliers == 0
