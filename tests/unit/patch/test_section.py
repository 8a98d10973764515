"""Section fits: tangent, curvature, and the scatter that their deviations promise."""

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, ball_height, graph_contours, moved, random_rotation
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.section import fit_sections


def parabola(curvature, reach, count, noise, rng):
    return graph_contours(lambda x, y: 0.5 * curvature * (x * x + y * y), reach, count, noise, rng)


def test_exact_parabola_gives_its_vertex_curvature():
    fits = fit_sections(np.zeros(3), parabola(-0.03, 10.0, 19, 0.0, np.random.default_rng(0)), 0.0)
    for fit in fits:
        # Identity: a quadratic is in the model; rounding only.
        assert fit.curvature_vector == pytest.approx([0.0, 0.0, -0.03], abs=1e-12)
        assert abs(fit.tangent[2]) < 1e-12


def test_section_curvature_scatter_follows_noise_rule():
    """std = sqrt(45) s / (L^2 sqrt n) for n even samples on +-L, exact as n grows."""
    rng = np.random.default_rng(1)
    noise, reach, count, draws = 0.02, 10.0, 41, 400
    bends, slopes, stated = [], [], []
    for _ in range(draws):
        for fit in fit_sections(np.zeros(3), parabola(-0.03, reach, count, noise, rng), noise):
            if fit.count == count:
                bends.append(fit.curvature_vector[2])
                slopes.append(fit.tangent[2])
                stated.append((fit.curvature_std, fit.tangent_std))
    sampling = 4.0 / np.sqrt(2 * len(bends))
    rule = np.sqrt(45.0) * noise / (reach**2 * np.sqrt(count))
    # n even samples including both ends: a few parts in n off the continuum rule.
    assert np.std(bends) == pytest.approx(rule, rel=sampling + 4.0 / count)
    assert np.std(bends) == pytest.approx(np.mean(stated, axis=0)[0], rel=sampling + 0.05)
    assert np.std(slopes) == pytest.approx(np.mean(stated, axis=0)[1], rel=sampling + 0.05)
    assert len(bends) > 0.9 * 3 * draws


def test_wide_window_is_given_up_where_the_curve_is_no_parabola():
    rng = np.random.default_rng(2)
    quiet = graph_contours(lambda x, y: 1e-3 * (x**2 + y**2) ** 2 / 4, 10.0, 41, 0.02, rng)
    for fit in fit_sections(np.zeros(3), quiet, 0.02):
        assert fit.count < 41


def test_oblique_section_of_a_ball_bends_more():
    tilt = 0.5
    contours = graph_contours(ball_height, 6.0, 25, 0.0, np.random.default_rng(3), tilt=tilt)
    for fit in fit_sections(np.zeros(3), contours, 0.0):
        bend = np.linalg.norm(fit.curvature_vector)
        # Narrowest window L = 0.35 * 6: bias (12/7) c4 L^2 with c4 = 1/(8 r^3), r the circle's.
        radius = BALL_RADIUS * np.cos(tilt)
        assert bend == pytest.approx(1.0 / radius, abs=2.1**2 / (4 * radius**3))


def test_rigid_motion_turns_the_answer():
    rng = np.random.default_rng(4)
    contours = graph_contours(ball_height, 12.0, 19, 0.02, rng)
    rotation, shift = random_rotation(rng), np.array([100.0, -20.0, 3.0])
    before = fit_sections(np.zeros(3), contours, 0.02)
    after = fit_sections(shift, moved(contours, rotation, shift), 0.02)
    for a, b in zip(before, after, strict=True):
        assert rotation @ a.curvature_vector == pytest.approx(b.curvature_vector, abs=1e-11)
        assert rotation @ a.tangent == pytest.approx(b.tangent, abs=1e-11)


def test_four_points_are_refused():
    plane = SamplingPlane(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    ends = (ContourEnd.LENGTH_REACHED,) * 2
    short = Contour(np.eye(3)[[0, 0, 2, 2]] * [[1], [2], [3], [4]], plane, 0.0, ends)
    with pytest.raises(ValueError, match="4 points"):
        fit_sections(np.zeros(3), (short,), 0.0)
