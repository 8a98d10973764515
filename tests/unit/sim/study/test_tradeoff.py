"""The study of accuracy against speed: what it measures, how, and that seeds settle it."""

import csv
import io
import time
from multiprocessing import active_children

import numpy as np
import pytest

from tests.command import touchatlas
from tests.truths import BALL_RADIUS, graph_contours
from touchatlas.patch import fit_patch
from touchatlas.sim.study.peers import fit_jet, mesh_around, mesh_curvatures
from touchatlas.sim.study.scenes import draw_scene
from touchatlas.sim.study.tradeoff import (
    CELLS,
    Cell,
    measure,
    measure_cell,
    middle,
    overall,
    timed,
    workers,
)
from touchatlas.sim.study.tradeoff_chart import csv_bytes, make_folder, pareto_front, write_chart
from touchatlas.sim.study.tradeoff_methods import METHODS, PAPER, height_error

TWO_CELLS = (Cell("ball", 0.02, False), Cell("torus", 0.0, True))


@pytest.fixture(scope="module")
def measured():
    """Rows of both cells, measured by two processes, and what was told while they worked."""
    told = []
    rows = measure(TWO_CELLS, draws=1, watch=lambda done, total: told.append((done, total)))
    return tuple(rows), told


@pytest.fixture
def rows(measured):
    return [dict(row) for row in measured[0]]


def table_of(data: bytes) -> list[dict]:
    return list(csv.DictReader(io.StringIO(data.decode())))


def without_times(data: bytes) -> list[dict]:
    return [{k: v for k, v in row.items() if k != "time_ratio"} for row in table_of(data)]


def test_every_method_has_a_row_in_every_cell(rows):
    assert len(rows) == len(METHODS) * len(TWO_CELLS)
    for row in rows:
        assert row["time_ratio"] > 0.0 and row["curvature_error"] >= 0.0
    ours = [row for row in rows if row["method"] == "map"]
    assert all(
        0.0 <= row["within"] <= 1.0 and row["max_error"] >= row["mean_error"] for row in ours
    )


def test_one_seed_gives_the_same_table_but_for_times(rows):
    # Whatever the other cells are, in whatever order and process they are measured.
    last, first = (measure_cell(cell, 1, 0) for cell in TWO_CELLS[::-1])
    assert without_times(csv_bytes([*first, *last])) == without_times(csv_bytes(rows))


def test_another_seed_gives_other_scenes(rows):
    other = measure_cell(TWO_CELLS[0], 1, 1)
    assert other[0]["mean_error"] != rows[0]["mean_error"]


def test_overall_has_one_row_a_method_and_ratios_to_the_paper(rows):
    found = {row["method"]: row for row in overall(rows)}
    assert list(found) == list(METHODS)
    assert found[PAPER]["error_to_paper"] == found[PAPER]["time_to_paper"] == 1.0
    assert found["map"]["error_to_paper"] < 1.0 and found["map"]["time_to_paper"] < 1.0
    assert np.isnan(found["igl_mesh"]["error_to_paper"])


def test_every_cell_is_told_when_it_is_done(measured):
    assert measured[1] == [(1, 2), (2, 2)]


def test_the_full_study_has_all_surfaces_noises_and_planes():
    assert len(CELLS) == len(set(CELLS)) == 36


@pytest.mark.parametrize(
    ("options", "words"),
    [({"draws": 0}, "draws is 0; it must be >= 1"), ({"seed": -1}, "seed is -1; it must be >= 0")],
)
def test_mistakes_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        measure(TWO_CELLS, **options)


def test_files_are_written(rows, tmp_path):
    make_folder(tmp_path / "a" / "b")
    write_chart(tmp_path / "a" / "b", rows)
    assert {p.name for p in (tmp_path / "a" / "b").iterdir()} == {"tradeoff.csv", "tradeoff.png"}
    table = table_of((tmp_path / "a" / "b" / "tradeoff.csv").read_bytes())
    assert [row["method"] for row in table] == [*METHODS, *METHODS]
    mesh = next(row for row in table if row["method"] == "igl_mesh")
    assert mesh["mean_error"] == "" and float(mesh["curvature_error"]) > 0.0
    assert (tmp_path / "a" / "b" / "tradeoff.png").read_bytes().startswith(b"\x89PNG")


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "a").write_text("")
    with pytest.raises(ValueError, match="is a file"):
        make_folder(tmp_path / "a")


def test_the_command_refuses_in_one_sentence(tmp_path):
    done = touchatlas("chart", "--draws", "0", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "touchatlas: draws is 0; it must be >= 1\n")
    assert not list(tmp_path.iterdir())


def test_medians_of_errors_and_means_of_fractions():
    rows = [{"mean_error": e, "within": w} for e, w in ((1.0, 0.0), (2.0, 1.0), (9.0, 1.0))]
    found = middle(rows)
    assert found["mean_error"] == 2.0 and found["within"] == pytest.approx(2.0 / 3.0)
    assert np.isnan(found["max_error"])


def test_front_holds_what_nothing_beats():
    points = [(1.0, 5.0), (2.0, 6.0), (3.0, 1.0), (3.5, 1.0), (0.5, np.nan)]
    assert pareto_front(points) == [(1.0, 5.0), (3.0, 1.0)]


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
    assert len(vertices) == METHODS["igl_mesh"].count
    assert vertices[0] == pytest.approx(scene.point)
    edges = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    assert edges.mean() == pytest.approx(scene.reach / 9, rel=1e-3)
    # A quadric through five rings: their half angle of 20 degrees squared.
    assert mesh_curvatures(vertices, faces)[0] == pytest.approx(-1.0 / BALL_RADIUS, rel=0.05)


def test_what_stops_a_study_ends_its_processes():
    """They are not waited for: a minute of work would be left."""
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt), workers(1) as pool:
        future = pool.submit(time.sleep, 60.0)
        while not future.running():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert time.monotonic() - begun < 30.0
    assert not active_children()
