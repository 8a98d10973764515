"""Section fits: tangent, curvature, and the scatter that their deviations promise."""

import numpy as np
import pytest

from tests.laws.patch_scenes import LENGTH, NOISE, WavyGraph, even_angles
from tests.truths import ball_height, graph_contours, moved
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.sim.study.cases import random_rotation


def parabola(curvature, reach, count, noise, rng):
    return graph_contours(lambda x, y: 0.5 * curvature * (x * x + y * y), reach, count, noise, rng)


def test_exact_parabola_gives_its_vertex_curvature():
    fits = fit_sections(np.zeros(3), parabola(-0.03, 10.0, 19, 0.0, np.random.default_rng(0)), 0.0)
    for fit in fits:
        # Identity: a quadratic is in the model; rounding only.
        assert fit.curvature_vector == pytest.approx([0.0, 0.0, -0.03], abs=1e-12)
        assert abs(fit.tangent[2]) < 1e-12


def test_wide_window_is_given_up_where_the_curve_is_no_parabola():
    rng = np.random.default_rng(2)
    quiet = graph_contours(lambda x, y: 1e-3 * (x**2 + y**2) ** 2 / 4, 10.0, 41, 0.02, rng)
    for fit in fit_sections(np.zeros(3), quiet, 0.02):
        assert fit.count < 41


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
    curvature = np.std([fit.curvature_vector[2] for fit in fits])
    slope = np.std([fit.tangent[2] for fit in fits])
    # 1800 fits: four standard errors are 7 %; the constants are those of many points, 2 % off.
    assert curvature == pytest.approx(6.71 * NOISE / (reach**2 * np.sqrt(count)), rel=0.1)
    assert slope == pytest.approx(1.73 * NOISE / (reach * np.sqrt(count)), rel=0.1)
    assert np.mean([fit.curvature_std for fit in fits]) == pytest.approx(curvature, rel=0.1)
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
