"""touchatlas export as a user meets it."""

import json
import subprocess
import sys

import networkx
import pytest

from tests.command import PROCESS, assert_refused, touchatlas
from tests.explored import explored, learned
from touchatlas.atlas import save_atlas


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with the atlas of four touches to 0.3; tests write beside it, not into it."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "a").mkdir()
    save_atlas(folder / "a" / "atlas.npz", learned(explored("sphere", max_touches=4).touches, 0.3))
    return folder


def test_export_writes_a_step_file_and_its_numbers(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    done = touchatlas("export", "a", "a.step", "--json", cwd=runs)
    assert done.returncode == 0, done.stderr
    numbers = json.loads(done.stdout)
    assert numbers["faces"] == numbers["triangles"] >= 4
    assert numbers["solids"] + numbers["open_shells"] >= 1
    assert (runs / "a.step").read_bytes().startswith(b"ISO-10303-21;")
    assert touchatlas("export", "a", "a.step", cwd=runs).returncode == 0


@pytest.mark.parametrize("name", ["faces.json", "faces.graphml"])
def test_export_writes_the_graph_of_faces(runs, name):
    done = touchatlas("export", "a", name, "--json", cwd=runs)
    assert done.returncode == 0, done.stderr
    numbers = json.loads(done.stdout)
    text = (runs / name).read_text()
    if name.endswith("json"):
        graph = networkx.node_link_graph(json.loads(text), edges="edges")
    else:
        graph = networkx.parse_graphml(text)
    assert len(graph) == numbers["faces"] >= 1
    assert graph.number_of_edges() == numbers["edges"]
    assert all(words for _, words in graph.nodes(data="words"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere", "x.step"), "nowhere holds no atlas.npz"),
        (("a", "a/atlas.npz"), "give a file that ends in .step"),
        (("a", "faces.csv"), "in .json or .graphml for the graph of faces"),
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
