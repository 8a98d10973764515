"""touchatlas regions as a user meets it."""

import json

import pytest
import trimesh

from tests.command import assert_refused, touchatlas
from touchatlas.atlas import load_atlas


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A folder with the run of a sphere; tests write beside it."""
    folder = tmp_path_factory.mktemp("runs")
    assert touchatlas("explore", "sphere", "--out", "a", cwd=folder).returncode == 0
    return folder


def test_regions_of_a_run_become_one_atlas_as_sure_as_its_own(run):
    """The ball of a run is one face by either way, and both tell the truth of the same touches: a
    quarter of the tolerance holds three deviations of a finished ball."""
    asked = "regions", "a", "--most", "4", "--workers", "0", "--json"
    done = touchatlas(*asked, cwd=run)
    assert done.returncode == 0, done.stderr
    numbers = json.loads(done.stdout)
    whole, atlas = (load_atlas(run / "a" / name) for name in ("atlas.npz", "regions/atlas.npz"))
    assert numbers["touches"] == atlas.touches == whole.touches
    assert numbers["points"] == whole.point_count and numbers["faces"] == 1
    vertices = trimesh.load(run / "a" / "regions" / "surface.ply").vertices
    assert abs(whole.blend(vertices).distance).max() < 0.25 * whole.tolerance
    assert touchatlas(*asked, cwd=run).stdout == done.stdout
    judged = touchatlas("evaluate", "a/regions", "--json", cwd=run)
    assert json.loads(judged.stdout)["met"] and json.loads(judged.stdout)["unit"] == "mm"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none",), "none is not the folder of a run"),
        (("a", "--most", "0"), "most is 0; a region has one touch or more"),
        (("a", "--overlap", "-1"), "overlap is -1.0; it must be a length >= 0"),
        (("a", "--tolerance", "nan"), "tolerance is nan"),
        (("a", "--out", "a"), "a is the run itself, whose atlas would be lost; give another --out"),
    ],
)
def test_regions_refuses_what_it_cannot_do(run, arguments, words):
    assert_refused(touchatlas("regions", *arguments, cwd=run), 2, words)
