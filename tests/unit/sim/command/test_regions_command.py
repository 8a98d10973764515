"""touchatlas regions as a user meets it."""

import json
import shutil
from contextlib import closing
from csv import DictReader

import numpy as np
import pytest
import trimesh

from tests.command import assert_refused, ran, touchatlas
from touchatlas.atlas import Touch, TouchStatus, load_atlas
from touchatlas.patch import SamplingPlane
from touchatlas.planner import ProbePlan, Reason
from touchatlas.sim import Journal
from touchatlas.sim.study.cells import LIMITED, Answer
from touchatlas.sim.study.workers import Here


@pytest.fixture(scope="module")
def run(tmp_path_factory, whole_run_in):
    """A folder with the run of a sphere; tests write beside it."""
    folder = tmp_path_factory.mktemp("runs")
    whole_run_in(folder / "a")
    return folder


def test_regions_of_a_run_become_one_atlas_as_sure_as_its_own(run):
    """The ball of a run is one face by either way, and both tell the truth of the same touches: a
    quarter of the tolerance holds three deviations of a finished ball."""
    asked = "regions", "a", "--most", "4", "--workers", "0", "--json"
    done = ran(*asked, cwd=run)
    numbers = json.loads(done.stdout)
    whole, atlas = (load_atlas(run / "a" / name) for name in ("atlas.npz", "regions/atlas.npz"))
    assert numbers["touches"] == atlas.touches == whole.touches
    assert numbers["points"] == whole.point_count and numbers["faces"] == 1
    vertices = trimesh.load(run / "a" / "regions" / "surface.ply").vertices
    assert abs(whole.blend(vertices).distance).max() < 0.25 * whole.tolerance
    assert touchatlas(*asked, cwd=run).stdout == done.stdout
    judged = touchatlas("evaluate", "a/regions", "--json", cwd=run)
    assert json.loads(judged.stdout)["met"] and json.loads(judged.stdout)["unit"] == "mm"


def test_a_run_that_met_nothing_has_no_regions_and_the_list_of_them_says_why(run):
    (run / "unmet").mkdir()
    shutil.copy(run / "a/run.toml", run / "unmet")
    up, at = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    plan = ProbePlan(0, at, up, (SamplingPlane(at, [1.0, 0.0, 0.0]),), 2.0, 1.0, 1.0, Reason.START)
    with closing(Journal(run / "unmet/journal.sqlite")) as journal:
        journal.append(plan, Touch(0, at, up, (), TouchStatus.NO_CONTACT, 0.0, 0.0))
    done = touchatlas("regions", "unmet", "--workers", "0", cwd=run)
    assert_refused(done, 2, "unmet/regions/regions.csv lists; give a larger --tolerance")
    [row] = DictReader((run / "unmet/regions/regions.csv").read_text().splitlines())
    assert row["why"] == "touch 0: the probe reported: no contact" and row["refused"] == "1"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--tolerance", "-1"), "touchatlas: --tolerance is -1.0; it must be"),
        (("--max-length", "1"), "touchatlas: --max-length is 1, but a holds"),
        (("--max-touches", "1"), "touchatlas: --max-touches is 1, but a holds"),
    ],
)
def test_resume_names_the_flags_of_what_it_refuses(run, arguments, words):
    assert_refused(touchatlas("resume", "a", *arguments, cwd=run), 2, words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none",), "none is not the folder of a run"),
        (("a", "--most", "0"), "most is 0; a region has one touch or more"),
        (("a", "--overlap", "-1"), "overlap is -1.0; it must be a length >= 0"),
        (("a", "--tolerance", "nan"), "touchatlas: --tolerance is nan"),
        (("a", "--out", "a"), "a is the run itself, whose atlas would be lost; give another --out"),
    ],
)
def test_regions_refuses_what_it_cannot_do(run, arguments, words):
    assert_refused(touchatlas("regions", *arguments, cwd=run), 2, words)


@pytest.mark.parametrize("command", ["resume", "view", "regions", "evaluate"])
def test_a_folder_of_regions_is_no_run_and_says_whose_it_is(run, tmp_path, command):
    """Without a surface it cannot be evaluated either."""
    shutil.copytree(run / "a", tmp_path / "a")
    ran("regions", "a", "--workers", "0", cwd=tmp_path)
    (tmp_path / "a" / "regions" / "surface.ply").unlink()
    held = contents(tmp_path)
    words = "a/regions is for the regions of a, and has no touches: touchatlas regions a learns"
    assert_refused(touchatlas(command, "a/regions", cwd=tmp_path), 2, words)
    assert contents(tmp_path) == held


def test_regions_of_another_run_are_replaced_by_force_alone(run, tmp_path):
    for name in ("a", "b"):
        shutil.copytree(run / "a", tmp_path / name, ignore=shutil.ignore_patterns("regions"))
    asked = "--workers", "0", "--out", "both"
    ran("regions", "a", *asked, cwd=tmp_path)
    held = contents(tmp_path)
    done = touchatlas("regions", "b", *asked, cwd=tmp_path)
    assert_refused(done, 2, "both already holds regions of a; choose another --out, or --force")
    wrong = touchatlas("regions", "b", *asked, "--force", "--most", "0", cwd=tmp_path)
    assert_refused(wrong, 2, "most is 0")
    done = touchatlas("regions", "b", "--out", "a", "--force", cwd=tmp_path)
    assert_refused(done, 2, "a holds run.toml, atlas.npz, surface.ply, of no set of regions")
    assert contents(tmp_path) == held
    ran("regions", "b", *asked, "--force", cwd=tmp_path)
    # A run and its regions may be moved together.
    (tmp_path / "new").mkdir()
    for name in ("b", "both"):
        (tmp_path / name).rename(tmp_path / "new" / name)
    done = ran("regions", "new/b", *asked[:3], "new/both", cwd=tmp_path)


def test_a_region_that_exceeds_its_limit_is_a_failure(run, tmp_path, monkeypatch):
    """The command is a proper one; that a limit was too small is found by measuring."""
    answer = Answer(LIMITED, words="it exceeded its time of 1 s")
    monkeypatch.setattr(Here, "answers", lambda _, measure, given: ((k, answer) for k in given))
    done = touchatlas("regions", "a", "--workers", "0", "--out", tmp_path / "r", cwd=run)
    assert_refused(done, 1, "region 0 was not learned: it exceeded its time of 1 s")


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
