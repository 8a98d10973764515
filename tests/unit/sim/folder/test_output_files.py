"""surface.ply, surface.png, compare: what is written for the eye and for other programs."""

import csv
import io
import json
import shutil
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import trimesh

from tests.command import assert_refused, ran, touchatlas
from touchatlas.atlas import Surface
from touchatlas.sim import load_run
from touchatlas.sim.command.compare import compare
from touchatlas.sim.folder.ply import ply_bytes, stored
from touchatlas.sim.judge.comparison import Comparison
from touchatlas.sim.judge.number_meanings import COLUMNS, NUMBERS
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.judge.surface_picture import surface_picture


def ball_surface(scale=1.0, shift=0.0):
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=scale)
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    deviation = scale * np.linspace(0.0, 0.02, len(vertices))
    zeros = np.zeros(len(vertices))
    return Surface(vertices + shift, faces, vertices / scale, deviation, zeros.astype(int), zeros)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_surface_is_stored_in_single_precision_and_read_back_as_it_was(tmp_path, scale):
    surface = ball_surface(scale)
    path = tmp_path / "s.ply"
    path.write_bytes(ply_bytes(surface, 0.01 * scale))
    assert path.read_bytes().count(b"property float") == 8
    vertices, faces, deviation, _ = load_surface(path)
    kept = stored(surface, 0.01 * scale)
    assert (vertices == kept.vertices).all() and (deviation == kept.deviation).all()
    assert (faces == surface.faces).all()
    # Half a unit of the last of 24 digits.
    assert np.abs(vertices - surface.vertices).max() <= 2.0**-24 * scale
    colours = trimesh.load(path, process=False).visual.vertex_colors[:, :3]
    assert (colours[0] == [68, 1, 84]).all() and (colours[-1] == [253, 231, 36]).all()


def test_a_surface_far_from_its_origin_keeps_double_precision(tmp_path):
    surface = ball_surface(shift=1e6)
    (tmp_path / "s.ply").write_bytes(ply_bytes(surface, 0.01))
    assert (load_surface(tmp_path / "s.ply")[0] == surface.vertices).all()


def test_the_picture_shows_the_error_where_it_is():
    """A ball that errs on the side x > 0 alone: yellow in the views from there, dark in others."""
    surface = ball_surface()
    body = surface.vertices, surface.faces
    error = np.where(surface.vertices[:, 0] > 0.0, 1.0, 0.0)
    image = matplotlib.image.imread(io.BytesIO(surface_picture("$b", body, error, body, 1.0)))
    height, width = image.shape[:2]
    # Views from x > 0 are the first and the last of four.
    row = image[int(0.1 * height) : int(0.5 * height), : int(0.85 * width), :3]
    yellow = (row[..., 0] > 0.5) & (row[..., 2] < 0.4)
    parts = [part.mean() for part in np.array_split(yellow, 4, axis=1)]
    # From 35 degrees beside the y axis a part of it is seen, too.
    assert min(parts[0], parts[3]) > 2.0 * max(parts[1], parts[2])


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_runs_are_compared_as_a_table_and_a_chart(whole_run, tmp_path):
    first = whole_run[0]
    words = ["--tolerance", 0.6, "--max-touches", 2, "--planner.curves", 4, "--out", "second"]
    done = ran("explore", "sphere", *words, cwd=tmp_path)
    done = touchatlas("compare", first, "second", "--out", "c", "--json", cwd=tmp_path)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    table = json.loads(done.stdout)
    assert table["second"]["planner.curves"] == 4 and table["whole"]["planner.curves"] == 3
    assert table["whole"]["touches"] == json.loads(whole_run[1])["touches"]
    assert "tolerance" in table["whole"] and "atlas.bias" not in table["whole"]
    rows = list(csv.DictReader((tmp_path / "c" / "compare.csv").read_text().splitlines()))
    assert [row["run"] for row in rows] == ["whole", "second"]
    assert float(rows[1]["coverage"]) == table["second"]["coverage"]
    assert (tmp_path / "c" / "compare.png").stat().st_size > 10_000
    shown = touchatlas("compare", first, "second", "--out", "c", cwd=tmp_path).stdout
    assert "planner.curves" in shown and "coverage" in shown


def test_an_option_that_is_also_a_number_has_one_column():
    numbers = {"tolerance": 0.1}, {"tolerance": 0.2}
    runs = Comparison(("a", "b"), {"tolerance": [0.1, 0.2]}, numbers, ([], []), ())
    header, *rows = csv.reader(runs.csv_bytes().decode().splitlines())
    assert header.count("tolerance") == 1
    assert [row[header.index("tolerance")] for row in rows] == ["0.1", "0.2"]


def test_runs_that_cannot_be_compared_are_refused(whole_run, tmp_path):
    one = whole_run[0]
    assert_refused(touchatlas("compare", one, cwd=tmp_path), 2, "give two or more different ones")
    assert_refused(touchatlas("compare", one, one, cwd=tmp_path), 2, "two or more different ones")
    assert_refused(touchatlas("compare", one, "x", cwd=tmp_path), 2, "not the folder of a run")
    other = shutil.copytree(one, tmp_path / "other")
    done = touchatlas("compare", one, other, "--out", one / "run.toml", cwd=tmp_path)
    assert_refused(done, 2, "run.toml is a file; give a folder with --out")
    (other / "evaluation.json").unlink()
    assert_refused(touchatlas("compare", one, other, cwd=tmp_path), 2, "touchatlas resume")


@pytest.mark.parametrize("listed", [NUMBERS, COLUMNS])
def test_the_documents_say_what_the_output_says(listed):
    document = (Path(__file__).parents[4] / "docs" / "output.md").read_text()
    rows = [f"| `{n}` | {m.what} | {m.unit} | {m.good} |" for n, m in listed.items()]
    assert "\n".join(rows) in document


def test_every_number_and_column_has_a_meaning(whole_run):
    folder, printed = whole_run
    assert set(json.loads(printed)) == set(NUMBERS)
    assert (folder / "steps.csv").read_text().splitlines()[0].split(",") == list(COLUMNS)


def test_five_runs_are_legible_in_eighty_columns(whole_run, tmp_path, capsys, monkeypatch):
    """Names of quantities and numbers stay whole; names of runs stand above their numbers."""
    monkeypatch.setenv("COLUMNS", "80")
    runs = [tmp_path / f"a-run-with-a-long-name-{i}" for i in range(5)]
    for run in runs:
        shutil.copytree(whole_run[0], run)
    compare(*runs, out=tmp_path / "out")
    shown = capsys.readouterr().out
    table = [line for line in shown.splitlines() if "│" in line]
    assert all(len(line) <= 80 for line in table) and "…" not in shown
    assert "5  a-run-with-a-long-name-4" in shown and "deviation_calibration" in shown
    touches = str(load_run(runs[0]).numbers["touches"])
    (row,) = [line for line in table if line.startswith("│ touches ")]
    assert [cell.strip() for cell in row.split("│")[2:-1]] == [touches] * 5
