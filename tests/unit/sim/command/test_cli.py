"""The command line as a user meets it: exit codes, one sentence each, results kept."""

import json
import shlex
import shutil
import subprocess
import sys
from contextlib import closing
from types import SimpleNamespace

import pytest
import trimesh

from tests.command import (
    PROCESS,
    UNDRAWN,
    WHOLE_RUN,
    assert_refused,
    progress_lines,
    ran,
    touchatlas,
    touchatlas_process,
)
from touchatlas.sim import make_object
from touchatlas.sim.command import run_end
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.world.mesh_object import MeshObject

FEW = ("--max-touches", 4, "--tolerance", 0.3)


def test_exploring_a_ball_meets_its_numbers(whole_run):
    numbers = json.loads(whole_run[1])
    assert numbers["coverage"] >= 0.99
    assert numbers["watertight"] and numbers["euler_characteristic"] == 2
    assert numbers["faces"] == 1
    # The tolerance is five deviations of the noise: a mean of one of them is a 95 % quantile of
    # half of it.
    assert numbers["met"] and numbers["completeness_mean"] <= numbers["noise_std"]
    assert numbers["total_curvature_over_2pi"] == pytest.approx(2.0, rel=0.01)


def test_run_folder_holds_what_the_contract_says(whole_run):
    folder, numbers = whole_run[0], json.loads(whole_run[1])
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "run.toml",
        "journal.sqlite",
        "atlas.npz",
        "surface.ply",
        "steps.csv",
        "evaluation.json",
        "progress.png",
        "surface.png",
        "replay.html",
    }
    assert json.loads((folder / "evaluation.json").read_text()) == numbers
    assert len((folder / "steps.csv").read_text().splitlines()) == numbers["touches"] + 1
    touches = kept(folder)
    assert len(touches) == numbers["touches"]
    assert sum(len(c.points) for t in touches for c in t.contours) == numbers["points"]


def test_one_seed_gives_byte_identical_runs_in_any_process(whole_run, tmp_path):
    done = touchatlas_process(*WHOLE_RUN, "--out", "again", cwd=tmp_path, process=UNDRAWN)
    assert done.returncode == 0, done.stderr
    for name in ("journal.sqlite", "atlas.npz", "surface.ply", "run.toml"):
        again = (tmp_path / "again" / name).read_bytes()
        assert again == (whole_run[0] / name).read_bytes(), name


def test_evaluate_compares_any_two_meshes(tmp_path):
    trimesh.creation.icosphere(subdivisions=4, radius=1.0).export(tmp_path / "a.stl")
    trimesh.creation.icosphere(subdivisions=4, radius=1.1).export(tmp_path / "b.ply")
    done = ran("evaluate", "a.stl", "--truth", "b.ply", "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["chamfer"] == pytest.approx(0.1, abs=0.005)


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_open_mesh_works_and_says_so(tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    mesh.update_faces(mesh.triangles_center[:, 2] > 10.0)
    mesh.export(tmp_path / "cap.ply")
    done = ran("explore", "cap.ply", "--out", "r", "--json", "--max-touches", 8, cwd=tmp_path)
    assert "open mesh" in done.stderr
    numbers = json.loads(done.stdout)
    assert numbers["true_euler_characteristic"] is None
    assert numbers["coverage"] > 0.5


def test_existing_run_is_refused_unless_forced(whole_run):
    folder, _ = whole_run
    before = (folder / "atlas.npz").read_bytes()
    done = touchatlas("explore", "sphere", "--out", folder, cwd=folder)
    assert_refused(done, 2, "already holds a run")
    assert (folder / "atlas.npz").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["explore", "botle"], "cube); did you mean bottle?"),
        (["explore", "nosuch"], "cube); give one of these, or a file"),
        (["explore"], "requires an argument; see touchatlas explore --help"),
        (
            ["explore", "sphere", "cube"],
            "leave out cube, or quote a name with spaces; see touchatlas explore --help",
        ),
        (["nosuch"], "export, chart, regions, study, paper; see touchatlas --help"),
        (["explore", "/dev/null"], "'/dev/null' is a device or a pipe"),
        (["evaluate", "/dev/null", "--truth", "sphere"], "/dev/null is a device or a pipe"),
        (["explore", "point.off"], "all its vertices are at one point"),
        (["chart", "--out", "tetra.off"], "tetra.off is a file; give a folder with --out"),
        (["explore", "sphere", "--out", "tetra.off"], "is a file"),
        (["chart", "--draws", "0"], "draws is 0; it must be >= 1"),
        (["paper", "--draws", "0"], "draws is 0; it must be >= 1"),
        (["paper", "--seed", "-1"], "seed is -1; it must be >= 0"),
        (["study", "none.toml"], "none.toml is no file"),
        (
            ["explore", "sphere", "--planner.coverage", "1"],
            "--planner.coverage is 1.0; it must be greater than 0 and less than 1",
        ),
        (
            ["explore", "sphere", "--planner.pin-radius", "5"],
            "--planner.pin-radius, --planner.pin-length are 5.0, 0.0; give both",
        ),
        (
            ["explore", "sphere", "--noise", "-1"],
            "--noise is -1.0; it must be a finite number, 0 or more",
        ),
        (["explore", "sphere", "--noise", "nan"], "noise is nan"),
        (
            ["explore", "sphere", "--tolerance", "0"],
            "is 0.0; it must be a finite number, more than 0",
        ),
        (["explore", "sphere", "--max-touches", "0"], "is 0; it must be a whole number, 1 or more"),
        (["explore", "sphere", "--max-length", "-2"], "max-length is -2"),
        (
            ["explore", "sphere", "--seed", "-3"],
            "--seed is -3; it must be a whole number, 0 or more",
        ),
        (["explore", "sphere", "--fault", "tip=1000"], "--fault is 'tip=1000'; tip is 114.3 at"),
        (["explore", "sphere", "--fault", "noise=1e6"], "--fault is 'noise=1e6'; noise is 1000 at"),
        (["explore", "sphere", "--seed", "1.5"], "'1.5' is no whole number"),
        (["explore", "sphere", "--noise", "1e6"], "more than 1000 times the tolerance"),
        (["explore", "sphere", "--tolerance", "1e6"], "object is only 114.3 across"),
        (["explore", "sphere", "--noise", "0", "--tolerance", "1e-300"], "1.1e-10 or more"),
        (["explore", "empty.off"], "empty.off"),
        (["explore", "missing.stl"], "there is no file 'missing.stl'"),
        (["explore", "huge.off"], "use another unit"),
        (["explore", "nan.off"], "NaN"),
        (["evaluate", "missing.ply", "--truth", "sphere"], "no file missing.ply"),
        (["evaluate", "missing"], "no file missing"),
        (["evaluate", "tetra.off"], "no truth was given"),
        (
            ["evaluate", "cut.ply", "--truth", "sphere"],
            "cut.ply cannot be read as a mesh: it is cut",
        ),
        (["evaluate", "short.ply", "--truth", "sphere"], "holds less than it declares"),
        (["evaluate", "tetra.off", "--truth", "sphere", "--tolerance", "1e300"], "114.3 across"),
        (["evaluate", "tetra.off", "--truth", "sphere", "--tolerance", "1e-300"], "1.1e-10"),
        (
            ["learn", "nan.csv", "--noise", "-1"],
            "--noise is -1.0; it must be a finite number, 0 or",
        ),
        (["chart", "--cell-seconds", "-1"], "--cell-seconds is -1.0; it must be a number"),
        (["fit", "nan.csv"], "nan.csv was read so"),
        (["evaluate", "tetra.off", "--truth", "sphere", "--tolerance", "-1"], "--tolerance is -1"),
        (["evaluate", "."], "not the folder of a run"),
        (["resume", "r", "--noise", "1"], "RUN/run.toml --noise VALUE --out ANOTHER"),
        (["resume", "r", "--odd", "1"], "Unknown option: --odd"),
    ],
)
def test_the_users_mistakes_are_one_sentence_and_exit_two(tmp_path, arguments, words):
    (tmp_path / "empty.off").write_text("OFF\n0 0 0\n")
    (tmp_path / "nan.csv").write_text("curve,x,y,z\na,0,0,nan\n")
    ply = "ply\nformat ascii 1.0\nelement vertex 3\n"
    (tmp_path / "cut.ply").write_text(ply)
    ply += "".join(f"property float {axis}\n" for axis in "xyz")
    ply += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "short.ply").write_text(ply + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    (tmp_path / "huge.off").write_text("OFF\n3 1 0\n1e99 0 0\n0 0 0\n0 1 0\n3 0 1 2\n")
    (tmp_path / "point.off").write_text("OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n")
    (tmp_path / "nan.off").write_text("OFF\n3 1 0\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    faces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    (tmp_path / "tetra.off").write_text(f"OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{faces}")
    assert_refused(touchatlas(*arguments, cwd=tmp_path), 2, words)


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_a_wall_without_thickness_is_approached_from_its_outer_side(tmp_path):
    """From above its edge alone could be met. Its normal is -y."""
    wall = "0 0 0\n1 0 0\n1 0 1\n0 0 1\n3 0 1 2\n3 0 2 3\n"
    (tmp_path / "wall.off").write_text(f"OFF\n4 2 0\n{wall}")
    words = ["--max-touches", 3, "--out", "r", "--json"]
    done = touchatlas("explore", "wall.off", *words, cwd=tmp_path)
    assert done.returncode == 0 and "contours lost contact" in done.stderr
    assert json.loads(done.stdout) == json.loads((tmp_path / "r" / "evaluation.json").read_text())
    assert make_object(str(tmp_path / "wall.off")).start()[1].tolist() == [0.0, -1.0, 0.0]


def test_touches_that_meet_nothing_are_said():
    met = {"touches": 24, "touches_without_contact": 24}
    words = run_end.no_surface(SimpleNamespace(numbers=met, refusal=""))
    assert "none of 24 touches met the object" in words


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_noise_that_hides_every_curve_is_a_failure_with_advice(tmp_path):
    words = ["--noise", 5, "--max-touches", 1, "--out", "r", "--json"]
    done = touchatlas("explore", "sphere", *words, cwd=tmp_path)
    assert done.returncode == 1
    assert "give less --noise or a larger --tolerance" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="a shell that closes and breaks streams")
@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("--version >&-", 0),
        ("nosuch 2>&-", 2),
        ("nosuch 2>/dev/full", 2),
        ("--version >/dev/full", 1),
        ("objects --json | true", 1),
    ],
)
def test_streams_that_nobody_reads_change_no_exit_code(tmp_path, command, code):
    quoted = " ".join(map(shlex.quote, PROCESS))
    script = f"set -o pipefail; {quoted} {command}"
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    assert "internal error" not in done.stderr and "Traceback" not in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    "command",
    [
        *("objects", "explore", "resume", "evaluate", "view", "compare", "export", "fit"),
        *("chart", "paper", "qualify", "learn", "next", "regions", "study"),
    ],
)
def test_every_command_explains_itself(tmp_path, command):
    done = touchatlas(command, "--help", cwd=tmp_path)
    assert done.returncode == 0 and "Usage" in done.stdout
    assert "ARGS" not in done.stdout


def test_the_help_tells_which_noise_and_tolerance_a_mesh_has_by_default(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=3.0)
    obj = MeshObject("ball", ball.vertices, ball.faces)
    assert obj.noise_std == pytest.approx(2e-4 * obj.diagonal)
    assert obj.tolerance == pytest.approx(1e-3 * obj.diagonal)
    words = " ".join(touchatlas("explore", "--help", cwd=tmp_path).stdout.replace("│", " ").split())
    assert "2e-4 of the diagonal of a mesh" in words and "1e-3 of the diagonal of a mesh" in words


def test_objects_lists_the_catalogue(tmp_path):
    rows = json.loads(touchatlas("objects", "--json", cwd=tmp_path).stdout)
    assert {row["name"] for row in rows} >= {"sphere", "torus", "bottle", "mouse", "blob", "plate"}
    ball = next(row for row in rows if row["name"] == "sphere")
    assert ball["extent"] == pytest.approx([66.0] * 3, abs=0.05)


@pytest.fixture(scope="module")
def _mesh_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    mesh.apply_scale([1.0, 0.5, 0.3])
    mesh.export(folder / "a[red]b.ply")
    done = ran("explore", "a[red]b.ply", *FEW, "--out", "[r]", "--json", cwd=folder)
    progress = set(progress_lines(done.stderr))
    said = [line for line in done.stderr.splitlines() if line not in progress]
    said = [line for line in said if "met nothing" not in line]
    numbers = json.loads(done.stdout)
    doubts = [doubt["words"].rstrip(".") for doubt in numbers["doubts"]]
    words = [*numbers["warnings"], "The exploration ended early", *doubts[1:]]
    assert len(said) == len(words), done.stderr
    assert all(word in line for word, line in zip(words, said, strict=True)), done.stderr
    return folder, done.stdout


@pytest.fixture
def mesh_run(_mesh_run, tmp_path):
    """A copy of a folder with a mesh and its run, and what the command printed."""
    return shutil.copytree(_mesh_run[0], tmp_path / "meshes"), _mesh_run[1]


def test_json_is_the_evaluation_file_byte_for_byte(mesh_run):
    folder, out = mesh_run
    assert out == (folder / "[r]" / "evaluation.json").read_text()


def test_evaluate_of_a_run_finds_the_very_numbers_of_the_run(mesh_run, whole_run):
    for folder, out in ((mesh_run[0] / "[r]", mesh_run[1]), whole_run):
        found = json.loads(touchatlas("evaluate", folder, "--json", cwd=mesh_run[0]).stdout)
        numbers = json.loads(out)
        # The same streams of random numbers on the same doubles.
        assert found == {name: numbers[name] for name in found}


def test_names_with_brackets_are_shown_as_they_are(mesh_run):
    done = touchatlas("evaluate", "[r]", cwd=mesh_run[0])
    assert "a[red]b" in done.stdout.replace("\n", "")


def test_a_run_without_its_settings_is_refused(mesh_run, tmp_path):
    run = mesh_run[0] / "[r]"
    (run / "run.toml").write_text("seed = 0\n")
    assert_refused(touchatlas("evaluate", run, cwd=tmp_path), 2, "lacks a proper object")


def test_a_run_is_not_compared_with_a_mesh_that_has_changed_unless_it_is_named(mesh_run):
    folder = mesh_run[0]
    settings = folder / "[r]" / "run.toml"
    settings.write_text(settings.read_text().replace('digest = "', 'digest = "other'))
    done = touchatlas("evaluate", "[r]", "--json", cwd=folder)
    assert_refused(done, 2, "a[red]b.ply has changed since the run was made")
    done = ran("evaluate", "[r]", "--truth", "a[red]b.ply", "--json", cwd=folder)


def test_a_run_whose_mesh_is_gone_shows_what_was_measured_at_its_end(mesh_run):
    folder, out = mesh_run
    (folder / "a[red]b.ply").unlink()
    settings = folder / "[r]" / "run.toml"
    # The file is named by its whole path, which is that of the first run.
    text = settings.read_text()
    settings.write_text(text.replace(json.loads(f'"{text.split(chr(34))[1]}"'), "/gone/ball.ply"))
    done = touchatlas("evaluate", "[r]", "--json", cwd=folder)
    assert done.returncode == 0 and json.loads(done.stdout) == json.loads(out)
    assert "no file /gone/ball.ply any more" in done.stderr and "end of the run" in done.stderr
    # Another tolerance needs the truth.
    done = touchatlas("evaluate", "[r]", "--tolerance", 1, cwd=folder)
    assert_refused(done, 2, "there is no file '/gone/ball.ply'")


def kept(folder):
    with closing(Journal(folder / "journal.sqlite")) as journal:
        return journal.touches()
