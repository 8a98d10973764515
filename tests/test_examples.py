"""Every example runs as its first lines say."""

import os
import runpy
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import trimesh

from touchatlas.sim.world.mesh_file import load_mesh

EXAMPLES = Path(__file__).parent.parent / "examples"
# Small stand-ins for the arguments that a reader would give.
ARGUMENTS = {
    "low_steps.py": ["50"],
    "faces.py": ["wall:8"],
    "forecast.py": ["sphere", "--workers", "1"],
    "fuzz_files.py": ["3"],
    "gallery.py": ["gallery", "sphere"],
    "guard.py": ["--only", "sphere", "--seeds", "1", "--renew", "--kept", "guard.csv"],
    "measurements.py": ["--check"],
    "probes.py": ["sphere", "--probes", "ideal", "contacts", "--workers", "1", "--most", "3"],
    "large_part.py": ["--columns", "1", "--rows", "1", "--touches", "16", "--most", "8"],
    "method_pictures.py": ["method"],
    "scan_and_touches.py": ["sphere"],
    "sections.py": ["cap.ply"],
    "smallest_features.py": ["sphere", "--seeds", "1", "--workers", "1", "--most", "3"],
    "speed.py": ["sphere:3", "--places", "6", "--cells", "8"],
    "study_on_workers.py": ["12"],
    "surface_peers.py": ["sphere", "4", "2e-4", "8"],
}


def run_example(name: str, *arguments) -> str:
    """What an example prints; in this process, so that imports are paid once."""
    words = [str(EXAMPLES / name), *map(str, arguments)]
    out = StringIO()
    with patch.object(sys, "argv", words), patch.dict(os.environ), redirect_stdout(out):
        try:
            runpy.run_path(words[0], run_name="__main__")
        except SystemExit as end:
            assert not end.code, out.getvalue()
    return out.getvalue()


# Examples that take four seconds to half a minute even with small arguments.
LONG = {
    "fuzz_files.py",
    "low_steps.py",
    "gallery.py",
    "guard.py",
    "jug.py",
    "large_part.py",
    "probes.py",
    "scan_and_touches.py",
    "sections.py",
    "study_on_workers.py",
    "surface_peers.py",
}
# Examples that a test below runs as their first lines say, and looks at what they did.
LOOKED_AT = {"own_robot.py", "vase_and_mug.py"}
NAMES = sorted({path.name for path in EXAMPLES.glob("*.py")} - LOOKED_AT)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in LONG else []) for n in NAMES]
)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small_cap().export("cap.ply")
    assert run_example(name, *ARGUMENTS.get(name, []))


def test_an_example_runs_in_a_process_of_its_own(tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", EXAMPLES / "own_robot.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "V - E + F = 2" in done.stdout


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("vase_and_mug.py", ["a file"], "a file is a file, or in one; give a folder"),
        pytest.param(
            "vase_and_mug.py",
            ["a file/in"],
            "a file/in is a file, or in one; give a folder",
            marks=pytest.mark.slow,
        ),
        ("fuzz_files.py", ["1"], "fuzz is a file here, where inputs are kept; move it away"),
    ],
)
def test_an_example_that_cannot_write_says_so_in_one_sentence(
    name, arguments, words, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for file in ("a file", "fuzz"):
        (tmp_path / file).touch()
    with patch.object(sys, "argv", [name, *arguments]), pytest.raises(SystemExit) as end:
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    said = capsys.readouterr().err
    assert end.value.code == 2 and words in said and said.count("\n") == 1


def small_cap() -> trimesh.Trimesh:
    """A mesh that a few touches explore: the top of a ball."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    mesh.update_faces(mesh.triangles_center[:, 2] > 28.0)
    return mesh


@pytest.mark.slow
def test_the_vase_and_the_mug_are_closed_walls_of_their_thickness(tmp_path):
    """Opposite each place of the wall is its other side. Vertices opposite each other are as far
    apart as triangles are long at most: the distance is too large by 0.05 mm at most."""
    run_example("vase_and_mug.py", tmp_path)
    rng = np.random.default_rng(0)
    for name, wall, euler in (("vase", 4.0, 2), ("mug", 5.0, 0)):
        mesh = trimesh.Trimesh(*load_mesh(tmp_path / f"{name}.ply"), process=False)
        assert mesh.is_watertight and mesh.euler_number == euler and mesh.volume > 0.0
        apart = []
        for i in rng.choice(len(mesh.vertices), 100, replace=False):
            facing = mesh.vertex_normals @ mesh.vertex_normals[i] < -0.999
            offset = mesh.vertices[facing] - mesh.vertices[i]
            apart.append(np.sqrt((offset**2).sum(axis=1)).min(initial=np.inf))
        assert np.median(apart) == pytest.approx(wall, abs=0.05)
