"""The study of accuracy against speed: what it measures, how, and that seeds settle it."""

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, graph_contours
from touchatlas.patch import fit_patch
from touchatlas.sim.study.fits import (
    FITS,
    PAPER,
    fit_jet,
    height_error,
    mesh_around,
    mesh_curvatures,
)
from touchatlas.sim.study.scenes import draw_scene
from touchatlas.sim.study.study import run
from touchatlas.sim.study.tables import number
from touchatlas.sim.study.tradeoff import (
    MESH,
    TRADEOFF,
    cells,
    measure_cell,
    middles,
    timed,
)

METHODS = (*FITS, MESH)
CELLS = (("ball", 0.02, "normal"), ("torus", 0.0, "tilted"))


@pytest.fixture(scope="module")
def rows(tmp_path_factory, no_processes):
    """Rows of both cells."""
    chosen = [cell for cell in cells(("ball", "torus"), 1, 0) if cell.given[:3] in CELLS]
    return run(TRADEOFF.study, chosen, tmp_path_factory.mktemp("chart"), lambda done, total: None)


def without_times(rows) -> list[dict]:
    return [{k: v for k, v in row.items() if k != "time_ratio"} for row in rows]


def test_every_method_has_a_row_in_every_cell(rows):
    assert len(rows) == len(METHODS) * len(CELLS)
    for row in rows:
        assert number(row["time_ratio"]) > 0.0 and number(row["curvature_error"]) >= 0.0
    for row in [row for row in rows if row["method"] == "map"]:
        assert 0.0 <= number(row["within"]) <= 1.0
        assert number(row["max_error"]) >= number(row["mean_error"])


def test_one_seed_gives_the_same_rows_but_for_times(rows):
    """Whatever the other cells are, in whatever order and process they are measured."""
    last, first = (measure_cell(*cell, 1, 0) for cell in CELLS[::-1])
    assert without_times([*first, *last]) == without_times(rows)
    other = measure_cell(*CELLS[0], 1, 1)
    assert other[0]["mean_error"] != rows[0]["mean_error"]


def test_overall_has_one_row_a_method_and_ratios_to_the_paper(rows):
    found = {row["method"]: row for row in TRADEOFF.summary(rows)}
    assert list(found) == list(METHODS)
    assert found[PAPER]["error_to_paper"] == found[PAPER]["time_to_paper"] == 1.0
    assert found["map"]["error_to_paper"] < 1.0 and found["map"]["time_to_paper"] < 1.0
    assert np.isnan(found["igl_mesh"]["error_to_paper"])


def test_the_full_study_has_all_surfaces_noises_and_planes():
    assert len({cell.given for cell in cells((), 50, 0)}) == 36


def test_medians_of_errors_and_means_of_fractions():
    rows = [{"mean_error": e, "within": w} for e, w in ((1.0, 0.0), (2.0, 1.0), (9.0, 1.0))]
    found = middles(rows)
    assert found["mean_error"] == 2.0 and found["within"] == pytest.approx(2.0 / 3.0)
    assert np.isnan(found["max_error"])


def test_timing_gives_the_answer_and_a_median():
    calls = []
    answer, seconds = timed(lambda x: calls.append(x) or len(calls), 7)
    assert answer == len(calls) > 3 and 0.0 < seconds < 0.05


def test_height_error_is_the_lift_of_a_point():
    scene = draw_scene("ellipsoid", 0.02, 0.0, np.random.default_rng(0))
    patch = fit_patch(scene.contact, scene.contours, scene.normal).patch
    at = height_error(patch, scene.verifying)
    lifted = scene.verifying + 0.3 * patch.frame.normal
    assert height_error(patch, lifted) == pytest.approx(at + 0.3, abs=1e-9)
    on_patch = scene.verifying - at[:, None] * patch.frame.normal
    assert patch.signed_distance(on_patch) == pytest.approx(0.0, abs=1e-9)


def test_jet_of_degree_four_recovers_a_quartic_from_five_sections():
    # Even in (x, y), so that the principal components are the axes.
    k1, k2 = 0.03, -0.02

    def quartic(x, y):
        return 0.5 * (k1 * x * x + k2 * y * y) + 1e-5 * (
            x**4 - 2.0 * x**3 * y + 3.0 * x * x * y * y
        )

    rng = np.random.default_rng(0)
    contours = graph_contours(quartic, 10.0, 19, 0.0, rng, np.pi / 5 * np.arange(5) + 0.1)
    samples = np.concatenate([c.points for c in contours])
    jet = fit_jet(np.zeros(3), samples, [0.0, 0.0, 1.0], 4)
    assert [jet.k1, jet.k2] == pytest.approx([k1, k2], rel=1e-9)
    x, y = rng.uniform(-8.0, 8.0, (2, 50))
    points = np.stack([x, y, quartic(x, y)], axis=1)
    assert jet.height_error(points) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("outward", [1.0, -1.0])
def test_jet_curvatures_follow_the_outward_side(outward):
    contours = graph_contours(lambda x, y: 0.01 * x * x, 10.0, 19, 0.0, np.random.default_rng(0))
    samples = np.concatenate([c.points for c in contours])
    jet = fit_jet(np.zeros(3), samples, [0.0, 0.0, outward], 2)
    assert sorted([jet.k1, jet.k2], key=abs) == pytest.approx([0.0, 0.02 * outward], abs=1e-9)


def test_mesh_is_as_dense_as_the_contours():
    scene = draw_scene("ball", 0.0, 0.0, np.random.default_rng(0))
    vertices, faces = mesh_around(scene, np.random.default_rng(1))
    assert len(vertices) == 271
    assert vertices[0] == pytest.approx(scene.point)
    edges = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    assert edges.mean() == pytest.approx(scene.reach / 9, rel=1e-3)
    # A quadric through five rings: their half angle of 20 degrees squared.
    assert mesh_curvatures(vertices, faces)[0] == pytest.approx(-1.0 / BALL_RADIUS, rel=0.05)
