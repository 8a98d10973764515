"""touchatlas export as a user meets it."""

import csv
import json
import subprocess
import sys

import networkx
import numpy as np
import pytest
import trimesh

from tests.command import PROCESS, assert_refused, ran, touchatlas
from tests.explored import explored, learned
from touchatlas.atlas import save_atlas


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with the atlas of four touches to 0.3; tests write beside it, not into it."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "a").mkdir()
    save_atlas(folder / "a" / "atlas.npz", learned(explored("sphere", 4).touches, 0.3))
    return folder


def test_export_writes_a_step_file_and_its_numbers(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    done = ran("export", "a", "a.step", "--json", cwd=runs)
    numbers = json.loads(done.stdout)
    assert numbers["faces"] == numbers["triangles"] >= 4
    assert numbers["solids"] + numbers["open_shells"] >= 1
    assert (runs / "a.step").read_bytes().startswith(b"ISO-10303-21;")
    ran("export", "a", "a.step", cwd=runs)


@pytest.mark.parametrize("name", ["faces.json", "faces.graphml"])
def test_export_writes_the_graph_of_faces(runs, name):
    done = ran("export", "a", name, "--json", cwd=runs)
    numbers = json.loads(done.stdout)
    text = (runs / name).read_text()
    if name.endswith("json"):
        graph = networkx.node_link_graph(json.loads(text), edges="edges")
    else:
        graph = networkx.parse_graphml(text)
    assert len(graph) == numbers["faces"] >= 1
    assert graph.number_of_edges() == numbers["edges"]
    assert all(words for _, words in graph.nodes(data="words"))


@pytest.mark.parametrize("name", ["steps.csv", "evaluation.json", "plans.json", "surface.step"])
def test_export_overwrites_no_file_of_the_run(runs, name):
    (runs / "link").unlink(missing_ok=True)
    (runs / "link").symlink_to("a")
    for folder in ("a", "link"):
        done = touchatlas("export", "a", f"{folder}/{name}", cwd=runs)
        assert_refused(done, 2, f"{folder}/{name} is a file of the run itself; give another name")
    assert not (runs / "a" / name).exists()


def test_the_table_of_faces_is_csv(runs):
    ran("export", "a", "faces.csv", cwd=runs)
    with open(runs / "faces.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows and {"face", "kind", "words", "samples", "x", "y", "z"} <= rows[0].keys()
    assert float(rows[0]["samples"]) > 0


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("in", 0.0254)])
def test_triangles_are_written_in_the_unit_of_the_format(runs, unit, metres):
    """A ball of radius 33, glTF in metres and 3MF in millimetres, read by trimesh."""
    pytest.importorskip("lxml")
    for name, scale in (("a.glb", metres), ("a.3mf", 1e3 * metres)):
        ran("export", "a", name, "--unit", unit, cwd=runs)
        mesh = trimesh.load(runs / name, force="mesh")
        # The middle of the ball is the origin; four touches know it to some tolerances of 0.3.
        radius = np.linalg.norm(mesh.vertices, axis=1).max() / scale
        assert radius == pytest.approx(33.0, abs=2.0)
    colours = trimesh.load(runs / "a.glb", force="mesh").visual.vertex_colors
    assert len(np.unique(colours, axis=0)) > 1


def test_a_run_without_a_unit_says_so_and_step_names_the_given_one(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    done = touchatlas("export", "a", "a.step", cwd=runs)
    assert "does not say its unit" in done.stderr
    done = touchatlas("export", "a", "a.step", "--unit", "m", cwd=runs)
    assert done.returncode == 0 and not done.stderr
    assert "SI_UNIT($,.METRE.)" in (runs / "a.step").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere", "x.step"), "nowhere holds no atlas.npz"),
        (("a", "a/atlas.npz"), "give a file that ends in .step"),
        (("a", "faces.xyz"), "in .json or .graphml for the graph of faces"),
        (("a", "a.glb", "--unit", "parsec"), "unit is 'parsec'; it must be one of"),
        (("a", "missing/x.step"), "missing is not a folder"),
        (("a",), "FILE"),
    ],
)
def test_the_users_mistakes_are_one_sentence_and_exit_two(runs, arguments, words):
    done = touchatlas("export", *arguments, cwd=runs)
    assert_refused(done, 2, words)
    assert not done.stdout


def test_missing_extra_is_the_users_to_install(runs, monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP", None)
    done = touchatlas("export", "a", "x.step", cwd=runs)
    assert_refused(done, 2, "pip install touchatlas[cad]")
    assert not (runs / "x.step").exists()


def test_a_full_disk_is_a_failure(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    limited = ["bash", "-c", 'ulimit -f 8; trap "" XFSZ; exec "$@"', "-", *PROCESS]
    command = [*limited, "export", "a", "x.step"]
    done = subprocess.run(command, cwd=runs, capture_output=True, text=True)
    assert done.returncode == 1 and "File too large" in done.stderr
    assert [p.name for p in runs.glob("x.step*")] == []
