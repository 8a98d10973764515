"""Laws that sections, principal curvatures and patches keep, each proved a second way."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import eigh, subspace_angles

from tests.laws.appendix_a import curvatures_of_three_sections
from tests.truths import ball_height, graph_contours, moved, random_rotation
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, fit_patch
from touchatlas.patch.fit.smoothness import coefficient_precision
from touchatlas.patch.geometry.contour import Contour, SamplingPlane
from touchatlas.patch.geometry.curvature import (
    UMBILIC_FALSE_ALARM,
    curvatures_from_sections,
)
from touchatlas.patch.geometry.polynomial import Z, evaluate, monge_basis, monomials
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.sim.study.scenes import POINTS_PER_ARM, SURFACES, Scene, draw_scene

UP = np.array([0.0, 0.0, 1.0])
LENGTH = 20.0
MONGE = FitOptions(height_only=True, adaptive=False)
NOISE = 0.02
SMOOTH_SURFACES = ["ball", "ellipsoid", "bottle_neck", "mouse"]


class WavyGraph:
    """z = sum a (sin(w . x + p) - its tangent plane at the origin): smooth, no polynomial."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.waves = rng.normal(size=(5, 2)) / LENGTH
        self.phase = rng.uniform(0.0, 2.0 * np.pi, 5)
        self.size = 0.2 * LENGTH * rng.normal(size=5)

    def __call__(self, x, y):
        along = np.multiply.outer(x, self.waves[:, 0]) + np.multiply.outer(y, self.waves[:, 1])
        sine, cosine = np.sin(self.phase), np.cos(self.phase)
        return (np.sin(along + self.phase) - sine - cosine * along) @ self.size

    def normal_curvature(self, angle: float) -> float:
        """At the origin, exact; positive where the graph bends upward."""
        slope = self.waves @ [np.cos(angle), np.sin(angle)]
        return float(-(self.size * np.sin(self.phase)) @ slope**2)


def even_angles(count: int) -> np.ndarray:
    return 0.2 + np.pi / count * np.arange(count)


def contours_of(height, reach, sections=3, noise=0.0, seed=0, points=41):
    rng = np.random.default_rng(seed)
    return graph_contours(height, reach, points, noise, rng, angles=even_angles(sections))


def random_sections(rng):
    """Three angles at least 0.05 rad apart: below, each route loses digits of its own."""
    while True:
        angles = rng.uniform(0.0, np.pi, 3)
        if np.abs(np.sin(angles - np.roll(angles, 1))).min() > 0.05:
            return angles


# The paper's appendix A against least squares.


@pytest.mark.parametrize("equal", [1, 2], ids=["all different", "two equal"])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_appendix_a_and_least_squares_agree_for_any_three_sections(equal, unit):
    """Any three normal curvatures are those of some quadric, so no truth is needed."""
    rng = np.random.default_rng(0)
    for _ in range(1000):
        angles, sections = random_sections(rng), unit * rng.uniform(-1.0, 1.0, 3)
        sections[:equal] = sections[0]
        order = rng.permutation(3)
        a1, a2, a_angle = curvatures_of_three_sections(sections[order], angles[order])
        b1, b2, b_angle, *_ = curvatures_from_sections(sections, angles, np.full(3, 1e-12 * unit))
        # Rounding times the square of the condition, at most 1e3 here: 2e-10 of what goes in,
        # and what comes out is as much larger as the condition.
        size = abs(b1) + abs(b2)
        assert abs(a1 - b1) < 1e-10 * size and abs(a2 - b2) < 1e-10 * size
        # A direction is as uncertain as the curvatures over their difference.
        assert abs(np.sin(a_angle - b_angle)) * (b1 - b2) < 1e-10 * size


def test_three_equal_sections_are_an_umbilic_by_both_routes():
    """Situation (a)."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        angles, k = random_sections(rng), rng.uniform(-1.0, 1.0)
        appendix = curvatures_of_three_sections(np.full(3, k), angles)
        k1, k2, angle, _, umbilic, _ = curvatures_from_sections(
            np.full(3, k), angles, np.full(3, 1e-6)
        )
        assert umbilic
        assert np.abs(np.subtract((k1, k2, angle), appendix)).max() < 1e-10


@pytest.mark.parametrize("turn", [0.0, np.pi, -np.pi])
def test_sections_of_one_direction_are_refused_by_both_routes(turn):
    """Situation (b): two of the three equations are one."""
    angles, sections = np.array([0.3, 1.1, 0.3 + turn]), np.array([0.1, -0.2, 0.1])
    for route in (curvatures_of_three_sections, curvatures_from_sections):
        with pytest.raises(ValueError, match="direction"):
            route(sections, angles, *([np.ones(3)] if route is curvatures_from_sections else []))


# Sections.


@pytest.mark.parametrize("count", [41, 81])
def test_section_scatter_is_the_noise_floor_and_is_told(count):
    """All draws, whichever windows the data choose: a curve that is a parabola needs the whole."""
    reach, rng = 10.0, np.random.default_rng(count)
    fits = [
        fit
        for _ in range(600)
        for fit in fit_sections(
            np.zeros(3),
            graph_contours(lambda x, y: -0.015 * (x * x + y * y), reach, count, NOISE, rng),
            NOISE,
        )
    ]
    bend = np.std([fit.curvature_vector[2] for fit in fits])
    slope = np.std([fit.tangent[2] for fit in fits])
    # 1800 fits: four standard errors are 7 %; the constants are those of many points, 2 % off.
    assert bend == pytest.approx(6.71 * NOISE / (reach**2 * np.sqrt(count)), rel=0.1)
    assert slope == pytest.approx(1.73 * NOISE / (reach * np.sqrt(count)), rel=0.1)
    assert np.mean([fit.curvature_std for fit in fits]) == pytest.approx(bend, rel=0.1)
    assert np.mean([fit.tangent_std for fit in fits]) == pytest.approx(slope, rel=0.1)


@pytest.mark.parametrize("tilt", [0.0, 15.0, 30.0, 45.0])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_oblique_sections_have_the_normal_curvature_of_the_upright_one(tilt, seed):
    """Meusnier. A quadratic over +-L errs as L^2 in curvature, from the upright and from the
    slanting side: its error falls by four when L is halved, and at last there is none."""
    graph, errors = WavyGraph(seed), []
    exact = np.array([graph.normal_curvature(a) for a in even_angles(3)])
    for reach in (2.0, 1.0, 0.1):
        contours = graph_contours(
            graph, reach, 41, 0.0, np.random.default_rng(0), even_angles(3), np.deg2rad(tilt)
        )
        fits = fit_sections(np.zeros(3), contours, 0.0)
        errors.append(np.array([fit.curvature_vector[2] for fit in fits]) - exact)
    assert np.log2(np.linalg.norm(errors[0]) / np.linalg.norm(errors[1])) == pytest.approx(
        2, abs=0.2
    )
    # (L/LENGTH)^2 with L = 0.035, and waves of up to three over LENGTH.
    assert np.abs(errors[2]).max() < 10.0 * (0.035 / LENGTH) ** 2 * np.abs(exact).max()


# Principal curvatures from sections.


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_scatter_of_principal_curvatures_falls_with_the_sections(count):
    rng, angles, std = np.random.default_rng(count), even_angles(count), 1e-3
    truth = 2.0 * np.cos(angles - 0.4) ** 2 - np.sin(angles - 0.4) ** 2
    draws = np.array(
        [
            curvatures_from_sections(
                truth + std * rng.normal(size=count), angles, np.full(count, std)
            )[:3]
            for _ in range(3000)
        ]
    )
    # Four standard errors of a standard deviation from 3000 draws are 5 %.
    assert draws[:, 0].std() == pytest.approx(std * np.sqrt(3 / count), rel=0.1)
    assert draws[:, 1].std() == pytest.approx(std * np.sqrt(3 / count), rel=0.1)
    # k1 - k2 = 3; for three sections sqrt(2/3) std / (k1 - k2).
    assert draws[:, 2].std() == pytest.approx(np.sqrt(2 / count) * std / 3.0, rel=0.1)


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_umbilic_gap_is_a_bias_and_its_test_errs_as_often_as_stated(count):
    rng, angles, std, draws = np.random.default_rng(count), even_angles(count), 1e-3, 4000
    found = [
        curvatures_from_sections(-0.03 + std * rng.normal(size=count), angles, np.full(count, std))
        for _ in range(draws)
    ]
    gaps = np.array([k1 - k2 for k1, k2, *_ in found])
    # b and c are independent with variance 2 std^2/m: twice a Rayleigh mean, 2.05 std for m = 3,
    # known to 0.52/sqrt(draws) of itself.
    mean = 2.0 * np.sqrt(2.0 / count) * np.sqrt(np.pi / 2.0) * std
    assert gaps.mean() == pytest.approx(mean, rel=4.0 * 0.53 / np.sqrt(draws))
    rate = UMBILIC_FALSE_ALARM
    alarms = np.mean([not umbilic for *_, umbilic, _ in found])
    assert abs(alarms - rate) < 4.0 * np.sqrt(rate * (1.0 - rate) / draws)


# Order of error.


def rms_error(fit: PatchFit, height, reach) -> float:
    """Over the disc of 0.7 reach."""
    i = np.arange(300) + 0.5
    r, a = 0.7 * reach * np.sqrt(i / 300), i * np.pi * (3.0 - np.sqrt(5.0))
    x, y = r * np.cos(a), r * np.sin(a)
    distance = fit.patch.signed_distance(np.column_stack([x, y, height(x, y)]))
    return float(np.sqrt(np.mean(distance**2)))


@pytest.fixture(scope="module")
def errors_by_reach():
    """errors[sections][options]: (reaches, graphs) errors of noise-free patches."""
    reaches = {3: (2.0, 1.0), 4: (0.5, 0.25), 5: (4.0, 2.0)}
    graphs = [WavyGraph(seed) for seed in range(8)]
    return {
        sections: {
            options: np.array(
                [
                    [
                        rms_error(
                            fit_patch(
                                np.zeros(3), contours_of(g, reach, sections), UP, options=options
                            ),
                            g,
                            reach,
                        )
                        for g in graphs
                    ]
                    for reach in reaches[sections]
                ]
            )
            for options in (MONGE, FitOptions())
        }
        for sections in reaches
    }


@pytest.mark.parametrize("options", [MONGE, FitOptions()], ids=["monge", "default"])
@pytest.mark.parametrize("sections", [3, 4, 5])
def test_halving_the_radius_divides_the_error_by_the_order_that_is_not_seen(
    sections, options, errors_by_reach
):
    """m sections determine all of degree m - 1, and leave out R^m: for three a cubic, for four a
    quartic. For five the quartic is complete and leaves out R^5. Geometric means over graphs.

    Radii are such that the next order is small (which for four sections has the larger factor),
    and rounding, 1e-6 of the radius times what the prior holds, is smaller yet.
    """
    far, near = np.log2(errors_by_reach[sections][options]).mean(axis=1)
    assert far - near == pytest.approx(sections, abs=0.2)


@pytest.mark.parametrize("sections", [3, 4, 5])
def test_default_errs_no_more_than_the_monge_quartic_at_any_radius(sections, errors_by_reach):
    """What no section sees is the same for both: 5 % for how the prior shares it out."""
    errors = errors_by_reach[sections]
    ratio = np.log(errors[FitOptions()] / errors[MONGE]).mean(axis=1)
    assert (ratio < np.log(1.05)).all()


# What sections can tell.


def line_products(angles, basis) -> np.ndarray:
    """(15, f) coefficients of l1 l2 ... lm times every monomial that keeps degree 4."""
    x, y = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 100))
    product = np.prod([np.cos(a) * y - np.sin(a) * x for a in angles], axis=0)
    if len(angles) > 4:
        return np.zeros((basis.size, 0))
    factors = monomials(monge_basis(4 - len(angles)), x, y, 0.0 * x)
    return np.linalg.lstsq(monomials(basis, x, y, 0.0 * x).T, (product * factors).T, rcond=None)[0]


@pytest.mark.parametrize(("sections", "unknown"), [(3, 3), (4, 1), (5, 0)])
def test_concurrent_sections_are_blind_to_products_of_their_lines_alone(sections, unknown):
    angles, basis, s = even_angles(sections), monge_basis(4), np.linspace(-1.0, 1.0, 41)
    x, y = np.outer(np.cos(angles), s).ravel(), np.outer(np.sin(angles), s).ravel()
    design = monomials(basis, x, y, 0.0 * x).T
    singular = np.linalg.svd(design, compute_uv=False)
    # Rounding on one side of the gap, a share of the largest that noise can pay for on the other.
    assert (singular < 1e-12 * singular[0]).sum() == unknown
    assert (singular > 1e-2 * singular[0]).sum() == basis.size - unknown
    products = line_products(angles, basis)
    assert np.linalg.matrix_rank(products) == products.shape[1] == unknown
    assert np.abs(design @ products).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
@pytest.mark.parametrize(("sections", "unknown"), [(3, 3), (4, 1), (5, 0)])
def test_deviation_is_large_along_what_sections_do_not_see_and_nowhere_else(
    sections, unknown, seed
):
    """Noise nil, so that data leave no doubt where they speak. What the prior decides of a
    direction is its variance after the data over its variance before, C P^-1: eigenvalue 1 and
    eigenvector w where the data are blind to w, for C^-1 = P^-1 + (what the data tell)."""
    fit = fit_patch(np.zeros(3), contours_of(WavyGraph(seed), 0.8 * LENGTH, sections), UP)
    after, before = heights_covariance(fit)
    shares, vectors = eigh(after, before)
    # In between is nothing. A share far below one: terms in z tie what is blind to what is seen.
    assert (shares > 0.1).sum() == unknown and (shares < 0.01).sum() == len(shares) - unknown
    lines = [np.cos(even_angles(sections)), np.sin(even_angles(sections)), np.zeros(sections)]
    x, y, _ = fit.patch.frame.axes @ lines
    products = line_products(np.arctan2(y, x), monge_basis(4))
    blind = before @ vectors[:, shares > 0.1]
    # An angle of what orders above 4 leave in the Taylor coefficients.
    assert unknown == 0 or subspace_angles(blind, products).max() < 0.02


def heights_covariance(fit: PatchFit):
    """Covariances (15, 15), after and before the data, of the coefficients up to degree 4 of the
    height that solves z = phi(x, y, z): terms in z repeat those without, so the surface may be
    known where its terms are not.

    A change dc of the terms raises the height by dc . terms / (1 - phi_z); its Taylor
    coefficients are of a fit of degree 8 over a small disc.
    """
    basis, coefficients = fit.patch.polynomial.basis, fit.patch.polynomial.coefficients
    x, y = 0.2 * np.random.default_rng(0).uniform(-1.0, 1.0, (2, 400))
    z = fit.patch.polynomial.height(fit.patch.radius * np.column_stack([x, y])) / fit.patch.radius
    upright = 1.0 - evaluate(basis, coefficients, x, y, z, (Z,))[0]
    raised = (monomials(basis, x, y, z)[: basis.size] / upright).T
    taylor = np.linalg.lstsq(monomials(monge_basis(8), x, y, z).T, raised, rcond=None)[0][:15]
    prior = np.diag(1.0 / coefficient_precision(basis, fit.length_ratio, fit.z_scale))
    return taylor @ fit.patch.covariance @ taylor.T, taylor @ prior @ taylor.T


# The same patch, told differently.


@cache
def scene_of(surface: str, draw: int, sections: int = 3, points: int = POINTS_PER_ARM) -> Scene:
    rng = np.random.default_rng([sections, draw])
    return draw_scene(surface, NOISE, 0.0, rng, sections, points=points)


def fit_of(scene: Scene, contours=None, **more) -> PatchFit:
    return fit_patch(scene.contact, contours or scene.contours, scene.normal, **more)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("surface", [*SMOOTH_SURFACES, "torus"])
def test_unit_and_place_leave_the_patch_the_same(surface, scale):
    """Identities but for rounding, which the prior's condition, 1e6 at most, may enlarge."""
    for draw in range(3):
        rng = np.random.default_rng([1, draw])
        scene = draw_scene(surface, NOISE, 0.3, rng)
        rotation, shift = random_rotation(rng), 50.0 * rng.normal(size=3)
        one = fit_of(scene).patch
        there = moved(scene.contours, rotation, shift, scale)
        two = fit_patch(scale * rotation @ scene.contact + shift, there, rotation @ scene.normal)
        assert two.patch.radius == pytest.approx(scale * one.radius, rel=1e-6)
        assert two.patch.curvatures.k2 * scale == pytest.approx(one.curvatures.k2, rel=1e-6)
        points = scale * scene.verifying @ rotation.T + shift
        error = two.patch.signed_distance(points) / scale - one.signed_distance(scene.verifying)
        assert np.abs(error).max() < 1e-6 * one.radius
        deviation = one.deviation(scene.verifying)
        assert two.patch.deviation(points) / scale == pytest.approx(deviation, rel=1e-6)


@pytest.mark.parametrize("noise", [0.0, 1e-4, NOISE])
@pytest.mark.parametrize("surface", SURFACES)
def test_a_motion_moves_the_heights_by_rounding_alone(surface, noise):
    """Umbilics and exact contacts too: their directions follow the first section, and heights
    are refined to the last digits. 1e-9 of the radius, the share at which frames are level."""
    for draw in range(4):
        rng = np.random.default_rng([6, draw])
        scene = draw_scene(surface, noise, 0.3 * (draw % 2), rng)
        rotation, shift = random_rotation(rng), 50.0 * rng.normal(size=3)
        there = moved(scene.contours, rotation, shift, 7.3)
        one = fit_of(scene).patch
        two = fit_patch(7.3 * rotation @ scene.contact + shift, there, rotation @ scene.normal)
        points = 7.3 * scene.verifying @ rotation.T + shift
        error = two.patch.signed_distance(points) / 7.3 - one.signed_distance(scene.verifying)
        assert np.abs(error).max() < 1e-9 * one.radius


@pytest.mark.parametrize("surface", SMOOTH_SURFACES)
def test_shared_contacts_lower_the_deviation(surface):
    """Forty more of them, at random between the curves, on each of ten patches."""
    for draw in range(10):
        rng, scene = np.random.default_rng([3, draw]), scene_of(surface, draw)
        shared = scene.verifying[rng.choice(len(scene.verifying), 40, replace=False)]
        shared = shared + NOISE * rng.normal(size=shared.shape)
        alone = fit_of(scene).patch.deviation(scene.verifying)
        together = fit_of(scene, shared=shared).patch.deviation(scene.verifying)
        assert together.mean() < alone.mean()


# Contours that are not as they should be.


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


@pytest.mark.parametrize("situation", UNEVEN)
@pytest.mark.parametrize("surface", SMOOTH_SURFACES)
def test_error_stays_within_three_deviations_however_curves_run(surface, situation):
    for draw in range(6):
        rng, scene = np.random.default_rng([4, draw]), scene_of(surface, draw)
        assert error_in_deviations(fit_of(scene, UNEVEN[situation](scene, rng)), scene) < 3.0


@pytest.mark.parametrize("sections", [4, 5, 6])
@pytest.mark.parametrize("surface", [*SMOOTH_SURFACES, "torus"])
def test_error_stays_within_three_deviations_with_more_curves(surface, sections):
    for draw in range(6):
        scene = scene_of(surface, draw, sections)
        assert error_in_deviations(fit_of(scene), scene) < 3.0


def error_in_deviations(fit: PatchFit, scene: Scene) -> float:
    """Root mean square of error over predicted deviation, over verifying points in the radius."""
    patch = fit.patch
    near = np.linalg.norm(scene.verifying - patch.frame.origin, axis=1) <= patch.radius
    points = scene.verifying[near]
    return float(np.sqrt(np.mean((patch.signed_distance(points) / patch.deviation(points)) ** 2)))


def test_a_contact_far_out_at_the_middle_of_a_curve_is_left_out():
    """Fifty deviations off, beside the reference point, where neighbours outvote it."""
    contours = contours_of(ball_height, 15.0, 3, NOISE, points=19)
    points = contours[1].points.copy()
    points[9, 2] += 50.0 * NOISE
    spoilt = (contours[0], Contour(points, contours[1].plane, NOISE, contours[1].ends), contours[2])
    clean, fit = fit_patch(np.zeros(3), contours, UP), fit_patch(np.zeros(3), spoilt, UP)
    assert (clean.outliers, fit.outliers) == (0, 1)
    # One of 57 samples less: its share of the error, and what its leaving moves the rest.
    where = clean.patch.frame.to_world(5.0 * np.eye(3)[:2])
    moved_by = clean.patch.signed_distance(where) - fit.patch.signed_distance(where)
    assert np.abs(moved_by).max() < NOISE
