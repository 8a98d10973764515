"""The README's robot loop, copied as it stands, runs with a probe and ends with a surface."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.explored import missed
from touchatlas.planner import StopReason
from touchatlas.sim import Probe, make_object

README = Path(__file__).parents[2] / "README.md"


def carry_out(robot) -> dict:
    """The names that the loop leaves behind."""
    loop = re.search(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert loop is not None
    names = {"robot": robot}
    exec(loop.group(1), names)
    return names


@pytest.fixture(scope="module")
def ended():
    """The loop on the bottle that its start belongs to."""
    bottle = make_object("bottle")
    return carry_out(Probe(bottle, bottle.noise_std, np.random.default_rng(0)))


def test_the_loop_ends_with_a_closed_surface_and_its_deviation(ended):
    surface, atlas = ended["surface"], ended["atlas"]
    assert ended["planner"].stop.reason is StopReason.KNOWN
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2
    assert len(surface.deviation) == len(surface.vertices) > 1000
    assert (surface.deviation > 0.0).all()
    # Vertices are on the zero set up to the height by which they are moved, 0.16 tolerances.
    assert np.median(np.abs(ended["distance"])) < 0.15 * atlas.tolerance


def test_the_end_of_the_loop_is_no_doubt(ended):
    found = ended["doubts"](ended["atlas"], ended["surface"], stopped=ended["planner"].stop)
    assert {"unfinished", "open places", "holes"}.isdisjoint(doubt.name for doubt in found)


def test_a_loop_that_meets_nothing_says_so(capsys):
    with pytest.raises(SystemExit, match="no touch gave a patch"):
        carry_out(missed)
    assert capsys.readouterr().out == f"{StopReason.NO_PATCH.value}\n"


def test_every_file_and_folder_that_it_names_is_there():
    text = README.read_text()
    for name in re.findall(r"\]\(([\w/.]+)\)", text):
        assert (README.parent / name).exists(), name
