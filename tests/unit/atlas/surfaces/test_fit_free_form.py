"""Free-form surfaces: how well overlapping sextics follow samples, and what they say beyond."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.explored import learned_at_once, spread_touches
from touchatlas.atlas.pieces.fit_piece import linear_fit
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.surfaces.fit_free_form import are_on, fit_free_form
from touchatlas.atlas.surfaces.free_form import FreeFormSurface
from touchatlas.atlas.surfaces.sextic_fit import coefficients_of, equations_of
from touchatlas.atlas.surfaces.sextic_sites import middles_of, sites_of
from touchatlas.atlas.surfaces.sextics import Sextics
from touchatlas.sim import make_object

# Radii of a torus, the noise of its samples, and the largest radius of a sextic on it: it turns by
# a radian.
LARGE, SMALL, NOISE, RADIUS = 30.0, 12.0, 0.02, 12.0


def torus(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a torus and its normals (n, 3)."""
    around, about = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (2, count))
    out = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1)
    normals = np.cos(about)[:, None] * out + np.sin(about)[:, None] * [0.0, 0.0, 1.0]
    return LARGE * out + SMALL * normals, normals


@pytest.fixture(scope="module")
def fitted():
    points, normals = torus(4000, 0)
    noise = NOISE * np.random.default_rng(1).normal(size=(4000, 1))
    return fit_free_form(points + noise * normals, normals, NOISE, RADIUS)


@pytest.mark.parametrize("count", [24, pytest.param(30, marks=pytest.mark.slow)])
def test_a_surface_faces_outward_where_a_sampling_plane_touches_it(count):
    """The normal of a sample may then be off by more than 40 degrees, because its contour shows
    nothing of the slope across it; those of the surface are off by a degree or two, and by more
    only where touches are far apart."""
    obj = make_object("mouse")
    atlas = learned_at_once(spread_touches(obj, count, obj.noise_std), obj.tolerance)
    surface = atlas.body.field.trees.free_form(0)
    true = obj.normal(obj.project(surface.points))
    turned = np.einsum("ij,ij->i", atlas.pool.normals, true)
    assert turned.min() < np.cos(np.deg2rad(40.0))
    faces = np.einsum("ij,ij->i", surface.normals, true)
    assert np.quantile(faces, 0.002) > np.cos(np.deg2rad(5.0))
    assert faces.min() > np.cos(np.deg2rad(20.0))


def test_a_sample_is_on_the_side_of_those_about_it_whatever_its_normal():
    """A normal across the surface, as of a section along it, is that of no side of a slab. Samples
    with one are on plane faces, at the corners of a square of 30."""
    rng = np.random.default_rng(0)
    points, true = make_object("plate").sample(600, rng)
    top = np.flatnonzero(true[:, 2] > 0.999)
    corners = 15.0 * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    wrong = top[cKDTree(points[top, :2]).query(corners)[1]]
    across = np.cross(true[wrong], [0.3, 0.5, 0.8]) - 0.1 * true[wrong]
    normals = true.copy()
    normals[wrong] = across / np.linalg.norm(across, axis=1)[:, None]
    noisy = points + 0.02 * rng.normal(size=points.shape)
    own = fit_free_form(noisy, normals, 0.02, 29.0).at_samples[wrong, 1:4]
    # Noise of 0.02 between samples 5 apart turns a plane by far less than 10 degrees.
    assert ((own * true[wrong]).sum(axis=1) > np.cos(np.radians(10.0))).all()


def test_a_torus_is_known_better_than_its_samples(fitted):
    """A sextic has 49 parameters and about 300 samples: two fifths of their noise, and less where
    several are averaged."""
    values = fitted.values(torus(2000, 2)[0])
    assert np.sqrt((values[:, 0] ** 2).mean()) < 0.6 * NOISE
    cosine = (values[:, 1:4] * torus(2000, 2)[1]).sum(axis=1)
    # The slope of a third of the noise over half of the radius.
    assert np.arccos(cosine.clip(-1, 1)).max() < 10.0 * NOISE / RADIUS


def test_errors_are_as_large_as_predicted(fitted):
    """Nine in ten at least lie within 1.96 deviations. Nearly all do on a smooth body: the mean of
    several sextics is surer than one, and the deviation has a floor. Deviations are no more than
    four times too large in the root mean square."""
    values = fitted.values(torus(2000, 2)[0])
    ratio = values[:, 0] / np.sqrt(values[:, 4])
    assert (np.abs(ratio) < 1.96).mean() > 0.9
    assert np.sqrt(np.mean(ratio**2)) > 0.25


def test_curvatures_of_a_torus_match_closed_form(fitted):
    """k1 = 1 / r, and k2 = cos v / (R + r cos v) (do Carmo, section 3-3)."""
    points, normals = torus(500, 2)
    about = np.arcsin(normals[:, 2])
    about = np.where(np.hypot(*points[:, :2].T) < LARGE, np.pi - about, about)
    expected = np.stack([np.full(500, 1 / SMALL), np.cos(about) / (LARGE + SMALL * np.cos(about))])
    found = np.linalg.eigvalsh(fitted.shape_operators(points))
    # One eigenvalue is that of the normal, which is 0.
    order = np.argsort(np.abs(found), axis=1)[:, 1:]
    found = np.sort(np.take_along_axis(found, order, axis=1), axis=1)
    off = np.abs(found - np.sort(expected, axis=0).T)
    assert np.median(off) < 0.05 / SMALL


def test_a_surface_moves_turns_and_scales_with_its_samples(fitted):
    points, normals = torus(1500, 3)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift, scale = np.array([5.0, -70.0, 11.0]), 1e3
    here = fit_free_form(points, normals, NOISE, RADIUS)
    there = fit_free_form(
        scale * points @ turn.T + shift, normals @ turn.T, scale * NOISE, scale * RADIUS
    )
    asked = torus(300, 5)[0] + np.random.default_rng(6).normal(size=(300, 3))
    one, other = here.values(asked), there.values(scale * asked @ turn.T + shift)
    assert other[:, 0] == pytest.approx(scale * one[:, 0], abs=1e-6 * scale)
    assert other[:, 1:4] == pytest.approx(one[:, 1:4] @ turn.T, abs=1e-6)
    assert other[:, 4] == pytest.approx(scale**2 * one[:, 4], rel=1e-4)


def test_between_two_contours_a_surface_is_less_sure_than_on_them():
    """Two parallel lines on a plane, a radius apart."""
    along = np.linspace(-20.0, 20.0, 81)
    points = np.concatenate([np.stack([along, np.full(81, y), 0 * along], 1) for y in (-6.0, 6.0)])
    found = fit_free_form(points, np.tile([0.0, 0.0, 1.0], (162, 1)), NOISE, RADIUS)
    on, between, beyond = found.values(np.array([[0.0, 6.0, 0.0], [0.0, 0.0, 0.0], [0, 15.0, 0]]))
    assert on[4] < between[4] < beyond[4]
    assert abs(between[0]) < 1e-6


def test_far_beyond_its_samples_a_face_goes_on_as_a_plane():
    """Of a bent strip; a sextic would come back from below within two of its radii."""
    x, y = np.random.default_rng(0).uniform(-10.0, 10.0, (2, 600))
    points = np.stack([x, y, -(x**2) / 40.0], axis=1)
    normals = np.stack([x / 20.0, 0 * x, np.ones(600)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found = fit_free_form(points, normals, NOISE, RADIUS)
    below = np.array([[0.0, 0.0, -40.0], [5.0, 5.0, -60.0], [0.0, 0.0, -500.0]])
    assert (found.values(below)[:, 0] < -20.0).all()
    assert (found.values(below * [1, 1, -1])[:, 0] > 20.0).all()


def test_samples_are_on_a_surface_where_it_is_known(fitted):
    points, normals = torus(50, 8)
    assert are_on(fitted, points, NOISE).all()
    assert not are_on(fitted, points + 8.0 * NOISE * normals, NOISE).any()
    # On the axis the surface is known so badly that any sample would do.
    assert not are_on(fitted, np.array([[0.0, 0.0, 0.0]]), NOISE).any()


def test_a_surface_before_saves_time_and_changes_nothing():
    """To the last bit: a loaded atlas has no surface before."""
    points, normals = torus(1500, 3)
    noisy = points + NOISE * np.random.default_rng(4).normal(size=(1500, 1)) * normals
    before = fit_free_form(noisy[:1450], normals[:1450], NOISE, RADIUS)
    alone = fit_free_form(noisy, normals, NOISE, RADIUS)
    after = fit_free_form(noisy, normals, NOISE, RADIUS, before)
    shared = before.kept.keys() & after.kept.keys()
    assert 0 < len(shared) < len(after.kept)
    assert all(after.kept[key] is before.kept[key] for key in shared)
    assert after.values(points).tobytes() == alone.values(points).tobytes()
    assert after.shape_operators(points).tobytes() == alone.shape_operators(points).tobytes()


def rippled(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a plane with ripples 100 times the noise high and 8 long, and normals."""
    points = np.random.default_rng(5).uniform(-10.0, 10.0, (count, 3))
    points[:, 2] = 100.0 * NOISE * np.sin(2.0 * np.pi * points[:, 0] / 8.0)
    slope = 100.0 * NOISE * 2.0 * np.pi / 8.0 * np.cos(2.0 * np.pi * points[:, 0] / 8.0)
    normals = np.stack([-slope, 0.0 * slope, np.ones(count)], axis=1)
    return points, normals / np.linalg.norm(normals, axis=1)[:, None]


def test_a_radius_is_tried_again_where_other_samples_try_it():
    """With a surface before or alone; those that came since count where they are told to."""
    points, normals = rippled(2470)

    def tried(count, first, before=None):
        columns = points[:count], normals[:count], NOISE, RADIUS, before
        found = fit_free_form(*columns, tried=first)
        return found, {key for key, kept in found.kept.items() if isinstance(kept, bool)}

    before, first = tried(2000, 2000)
    after, second = tried(2460, 2000, before)
    later, third = tried(2470, 2470, after)
    assert first and before.radius < RADIUS
    assert first == second and not first & third
    for count, own, found in ((2460, 2000, after), (2470, 2470, later)):
        alone = tried(count, own)[0]
        assert found.values(points).tobytes() == alone.values(points).tobytes()


def test_smaller_sextics_join_larger_ones_as_if_they_had_come_at_once(fitted):
    """What sextics say of the samples is the same but for the rounding of sums."""
    points, normals = rippled(2000)
    small = fit_free_form(points, normals, NOISE, 0.25 * RADIUS).sextics
    large = fit_free_form(points, normals, NOISE, RADIUS).sextics
    one = FreeFormSurface(large.some([0, 3]), points, normals)
    both = one.with_finer(small.some(np.arange(0, len(small), 2)))
    again = FreeFormSurface(both.sextics, points, normals)
    assert len(both.sextics) > 10
    assert np.abs(both.at_samples - again.at(points)).max() < 1e-12 * RADIUS


def test_an_extent_that_grows_a_little_leaves_most_sextics_as_they_are():
    """Largest radii are powers of one number, so that their samples are the same."""
    points, normals = torus(1500, 3)
    before = fit_free_form(points, normals, NOISE, RADIUS)
    after = fit_free_form(points, normals, NOISE, 1.001 * RADIUS, before)
    assert before.kept.keys() == after.kept.keys()
    assert after.values(points).tobytes() == before.values(points).tobytes()


@pytest.mark.parametrize("changed", ["points", "normals", "std"])
def test_a_surface_before_of_other_samples_changes_nothing(changed):
    points, normals = torus(600, 3)
    other, turned, std = points.copy(), normals.copy(), NOISE
    if changed == "points":
        other[0] += 3.0 * NOISE * normals[0]
    elif changed == "normals":
        turned[0] = -turned[0]
    else:
        std = 2.0 * NOISE
    before = fit_free_form(other, turned, std, RADIUS)
    after = fit_free_form(points, normals, NOISE, RADIUS, before)
    alone = fit_free_form(points, normals, NOISE, RADIUS)
    assert after.values(points).tobytes() == alone.values(points).tobytes()


def test_many_sextics_are_fitted_as_one_is():
    """Those of a smooth face are the same as with the fit of a single piece, but for the prior."""
    points, normals = torus(1500, 3)
    tree = cKDTree(points)
    sites = sites_of(tree, normals, middles_of(tree, normals, RADIUS, 0.5), RADIUS)
    coefficients = coefficients_of(equations_of(sites, points, NOISE, {}, {}))
    for k in range(0, len(sites.middles), 7):
        own, middle = points[sites.members[k]], points[sites.middles[k]]
        one = linear_fit(Kind.SEXTIC, own, middle, sites.axes[k], RADIUS, NOISE)
        assert coefficients[k] == pytest.approx(one.coefficients, abs=1e-7)


def _flat_sextics(coefficients, scale: float) -> Sextics:
    """Sextics about the origin, sure of themselves."""
    count, size = coefficients.shape
    sure = np.zeros((count, size, size), np.float32)
    middles, axes = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    return Sextics(middles, axes, np.full(len(middles), scale), coefficients, sure)


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_where_two_sextics_differ_their_mean_is_as_unsure_as_they_are_apart(scale):
    """Both are sure of themselves, one 0.1 above and one 0.1 below. The variance of two numbers
    about their mean, with one degree of freedom less, is twice 0.1 squared."""
    middle, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    flat = np.zeros((2, 49))
    flat[:, 0] = 0.1, -0.1
    both, alone = (
        FreeFormSurface(_flat_sextics(flat[:count], scale), middle, up).values(middle)[0]
        for count in (2, 1)
    )
    assert both[0] == pytest.approx(0.0, abs=1e-9 * scale)
    assert np.sqrt(both[4]) == pytest.approx(np.sqrt(2.0) * 0.1 * scale)
    assert alone[4] == pytest.approx(0.0, abs=1e-12 * scale**2)


@pytest.mark.parametrize("std", [NOISE, 0.0])
def test_samples_that_repeat_each_other_are_fitted(std):
    """More at each place than are ample for a sextic, however small it is."""
    points, normals = (np.repeat(x, 300, axis=0) for x in torus(20, 0))
    surface = fit_free_form(points, normals, std, RADIUS)
    assert np.abs(surface.values(points[::300])[:, 0]).max() <= max(std, 1e-4 * RADIUS)


def bump(x, y, width: float) -> np.ndarray:
    """(n, 3) points of the plane with a round bump of ten deviations of the noise."""
    height = 10.0 * NOISE * np.exp(-0.5 * (x * x + y * y) / width**2)
    return np.stack([x, y, height], axis=1)


@pytest.mark.parametrize("width", [0.8, 1.2])
def test_smaller_sextics_follow_what_larger_ones_leave_out(width):
    """A bump far narrower than a sextic, amid a plane that half of the samples show: the errors on
    it are no larger than the noise. Sextics of the largest radius alone leave more than half of it
    out (their root mean square is that of the bump, less what a polynomial of order six has)."""
    rng = np.random.default_rng(2)
    x, y = np.concatenate([rng.uniform(-30, 30, (2, 3000)), rng.normal(0, 2, (2, 1500))], axis=1)
    points, up = bump(x, y, width), np.tile([0.0, 0.0, 1.0], (4500, 1))
    noisy = points + NOISE * rng.normal(size=(4500, 1)) * up
    surface = fit_free_form(noisy, up, NOISE, RADIUS)
    radii = surface.sextics.radii
    largest = FreeFormSurface(surface.sextics.some(np.flatnonzero(radii == radii.max())), noisy, up)
    on = bump(*rng.normal(0.0, width, (2, 500)), width)
    off, alone = (np.sqrt(np.mean(one.at(on)[:, 0] ** 2)) for one in (surface, largest))
    assert radii.min() < radii.max()
    assert off < NOISE < 0.5 * alone
