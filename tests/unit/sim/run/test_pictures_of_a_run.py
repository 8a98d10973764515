"""The pictures that a run draws: without warnings, and without a trace in the caller's process."""

import matplotlib
import numpy as np
import pytest
import trimesh

from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.exploration import run_exploration
from touchatlas.sim.world.mesh_object import MeshObject

pytestmark = pytest.mark.usefixtures("few_judged")
PICTURES = "progress.png", "surface.png"


def ball(name: str) -> MeshObject:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    return MeshObject(name, np.asarray(mesh.vertices), np.asarray(mesh.faces))


def are_pictures(folder) -> bool:
    return all((folder / name).read_bytes().startswith(b"\x89PNG") for name in PICTURES)


def test_drawing_leaves_the_callers_back_end_alone(tmp_path):
    before = matplotlib.rcParams["backend"]
    try:
        matplotlib.rcParams["backend"] = "svg"
        run_exploration(ball("ball"), tmp_path / "r", RunOptions(max_touches=1))
        assert matplotlib.rcParams["backend"] == "svg" and are_pictures(tmp_path / "r")
    finally:
        matplotlib.rcParams["backend"] = before


def test_a_name_the_font_lacks_is_drawn_without_a_warning(tmp_path):
    run_exploration(ball("名前 😀"), tmp_path / "r", RunOptions(max_touches=1))
    assert are_pictures(tmp_path / "r")
