"""touchatlas learn and touchatlas next: files in, an atlas, and plans out."""

import json
from contextlib import closing

import numpy as np
import pytest

from tests.command import assert_refused, ran, touchatlas
from tests.pages import held
from touchatlas.atlas import load_atlas
from touchatlas.sim import Journal
from touchatlas.sim.run.learning import pending_plans

BEGIN = "next", "r", "--start=0,0,1", "--outward=0,0,1", "--tolerance=1"
AXES = np.array([30.0, 20.0, 15.0])


def ring(level, count=200):
    angle = np.arange(count) * 2.0 * np.pi / count
    radius = np.sqrt(1.0 - (level / AXES[2]) ** 2)
    x, y = AXES[0] * radius * np.cos(angle), AXES[1] * radius * np.sin(angle)
    return np.stack([x, y, np.full(count, level)], axis=1)


def write_rings(path, levels, seed=0):
    rng, rows = np.random.default_rng(seed), []
    for k, level in enumerate(levels):
        points = ring(level)
        points = points + rng.normal(0.0, 0.01, points.shape)
        rows += [(k, *point) for point in points]
    np.savetxt(path, rows, "%g", ",", header="curve,x,y,z", comments="")
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learn")
    file = write_rings(folder / "rings.csv", np.linspace(-14.0, 14.0, 9))
    ran("learn", file, "--unit", "mm", "--out", "run", cwd=folder)
    return folder / "run"


def test_sections_become_an_atlas_with_surface_picture_and_numbers(run):
    numbers = json.loads((run / "evaluation.json").read_text())
    assert numbers["watertight"] and numbers["unit"] == "mm" and numbers["points"] == 9 * 200
    # 0.01 were put on each coordinate; the estimate is good to a few percent.
    assert numbers["noise_std"] == pytest.approx(0.01, rel=0.2)
    assert numbers["predicted_coverage"] > 0.99
    assert (run / "surface.png").read_bytes()[1:4] == b"PNG"
    load_atlas(run / "atlas.npz").validate()
    page = held((run / "replay.html").read_text())
    assert page["touches"] == 0 and len(page["vertex_from"]) == 2
    # The sections are there before any touch.
    assert page["contour_from"].tolist() == [9 * 200]


def test_the_surface_is_written_as_step_where_the_kernel_is_installed(run):
    pytest.importorskip("OCP")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(run / "surface.step"))
    reader.TransferRoots()
    solid, volume = reader.OneShape(), GProp_GProps()
    assert BRepCheck_Analyzer(solid).IsValid()
    BRepGProp.VolumeProperties_s(solid, volume)
    # The surface is within a tolerance, 1e-3 of the diagonal of 78, of an ellipsoid.
    assert volume.Mass() == pytest.approx(4.0 / 3.0 * np.pi * AXES.prod(), rel=3 * 0.078 / 15.0)


def begun(folder, noise):
    """A run of the ellipsoid with its first plan pending."""
    start = "--start", "0,0,15", "--outward", "0,0,1", "--noise", noise, "--tolerance", "0.2"
    ran("next", "run", *start, cwd=folder)
    return folder / "run"


def answers(run):
    """CSV of a touch of the ellipsoid as the pending plan wants it."""
    [plan] = pending_plans(run).values()
    rows = ["plan,plane,x,y,z,event"]
    foot = plan.reference_point / np.linalg.norm(plan.reference_point / AXES)
    rows.append(f"{plan.number},,{foot[0]},{foot[1]},{foot[2]},contact")
    for k, plane in enumerate(plan.planes):
        along = np.cross(plane.normal, plan.normal)
        for s in np.linspace(-3.0, 3.0, 25):
            point = foot + s * along
            x, y, z = point / np.linalg.norm(point / AXES)
            rows.append(f"{plan.number},{k},{x},{y},{z},")
    return "\n".join(rows)


def in_unit(rows, factor, start=0.0):
    """Rows of answers with other lengths, but for z of the start."""
    found = []
    for row in rows:
        plan, plane, x, y, z, event = row.split(",")
        z = start + factor * (float(z) - start)
        found.append(f"{plan},{plane},{factor * float(x)},{factor * float(y)},{z},{event}")
    return found


def test_a_replay_shows_what_was_known_at_each_touch_of_each_call(tmp_path):
    run = begun(tmp_path, "0.001")
    for number in range(3):
        (tmp_path / "answer.csv").write_text(answers(run))
        more = () if number == 2 else ("--no-draw",)
        ran("learn", run, "answer.csv", *more, cwd=tmp_path)
        ran("next", run, cwd=tmp_path)
    page = held((run / "replay.html").read_text())
    assert page["touches"] == 3 and len(page["words"]) == 4
    # Before the second and the third touch a surface was known, and one at the end.
    assert len(page["vertex_from"]) == 4
    assert page["contour_from"].tolist() == [0, 75, 150, 225]


@pytest.mark.parametrize("lost", ["both", "planner"])
def test_a_call_that_is_killed_before_its_state_is_written_loses_nothing(tmp_path, lost):
    """The journal is written first, then the atlas, then the planner."""
    run = begun(tmp_path, "0.001")
    before = {name: (run / name).read_bytes() for name in ("atlas.npz", "planner.json")}
    (tmp_path / "answer.csv").write_text(answers(run))
    ran("learn", run, "answer.csv", "--no-draw", cwd=tmp_path)
    ran("next", run, cwd=tmp_path)
    plans, atlas = (run / "plans.json").read_bytes(), (run / "atlas.npz").read_bytes()
    with closing(Journal(run / "journal.sqlite")) as journal:
        journal.keep_settings({"learned": 0})
    for name in before if lost == "both" else ["planner.json"]:
        (run / name).write_bytes(before[name])
    ran("next", run, cwd=tmp_path)
    assert (run / "atlas.npz").read_bytes() == atlas
    assert (run / "plans.json").read_bytes() == plans


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_next_writes_plans_and_learn_takes_more_curves(run, tmp_path):
    listed = json.loads(touchatlas("next", run, "--json", cwd=run).stdout)["plans"]
    assert [plan["number"] for plan in listed] == sorted(pending_plans(run))
    before = load_atlas(run / "atlas.npz").point_count
    more = write_rings(tmp_path / "more.csv", [3.0], seed=1)
    ran("learn", run, more, "--no-draw", cwd=run)
    again = write_rings(tmp_path / "again.csv", [5.0], seed=2)
    ran("learn", run, again, cwd=run)
    assert load_atlas(run / "atlas.npz").point_count == before + 400


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_a_half_of_a_body_asks_which_side_is_outside(tmp_path):
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(600, 3))
    points = 10.0 * sphere / np.linalg.norm(sphere, axis=1)[:, None]
    points = points[points[:, 2] > 0.0] + rng.normal(0.0, 0.01, ((points[:, 2] > 0.0).sum(), 3))
    np.savetxt(tmp_path / "half.xyz", points, "%.4f")
    words = "learn", "half.xyz", "--out", "run"
    done = touchatlas(*words, cwd=tmp_path)
    assert done.returncode == 2 and "which side the outside is" in done.stderr
    assert not (tmp_path / "run").exists()
    ran(*words, "--viewpoint", "0,0,90", cwd=tmp_path)


@pytest.mark.parametrize(
    "words, said",
    [
        (("learn",), "requires an argument"),
        (("learn", "nothing.csv"), "is no file"),
        (("next", "nothing"), "no run that learns"),
        (("next", "nothing", "--count", "0"), "count is 0"),
        (("next", "nothing", "--start", "0,0,1"), "--outward"),
        *(
            (
                (*BEGIN, "--noise=0.02", "--planner", name),
                f"--planner is '{name}', which no file keeps between two calls; give one of tol",
            )
            for name in ("random", "gpis", "oracle")
        ),
        (
            ("next", "r", "--start=0,0,1", "--outward=0,0,1", "--noise=-0.02", "--tolerance=1"),
            "touchatlas: --noise is -0.02",
        ),
    ],
)
def test_mistakes_are_said_in_one_sentence(words, said, tmp_path):
    assert_refused(touchatlas(*words, cwd=tmp_path), 2, said)


def test_csv_answers_are_learned_and_wrong_ones_refused(tmp_path):
    run = begun(tmp_path, "0.01")
    [plan] = pending_plans(run).values()
    rows = ["plan,plane,x,y,z,event", "0,,0,0,15,contact"]
    for k, plane in enumerate(plan.planes):
        along = np.cross(plane.normal, plan.normal)
        for s in np.linspace(-3.0, 3.0, 25):
            x, y = s * along[:2]
            z = AXES[2] * np.sqrt(1.0 - (x / AXES[0]) ** 2 - (y / AXES[1]) ** 2)
            rows.append(f"0,{k},{x},{y},{z},")
    (tmp_path / "answer.csv").write_text("\n".join(rows))
    words = "learn", run, "answer.csv", "--no-draw"
    ran(*words, cwd=tmp_path)
    assert_refused(touchatlas(*words, cwd=tmp_path), 2, "plan 0 is not pending")
    ran("next", run, "--count", "2", cwd=tmp_path)
    assert min(pending_plans(run)) == 1
    (tmp_path / "miss.csv").write_text("plan,plane,x,y,z,event\n1,,,,,no contact\n")
    ran("learn", run, "miss.csv", "--no-draw", cwd=tmp_path)


@pytest.mark.usefixtures("no_pictures", "few_judged")
def test_an_answer_in_another_unit_is_refused_and_the_run_goes_on(tmp_path):
    run = begun(tmp_path, "0.001")
    for _ in range(4):
        (tmp_path / "answer.csv").write_text(answers(run))
        ran("learn", run, "answer.csv", "--no-draw", cwd=tmp_path)
        ran("next", run, cwd=tmp_path)
    head, *rows = answers(run).split("\n")
    (tmp_path / "inches.csv").write_text("\n".join([head, *in_unit(rows, 1.0 / 25.4)]))
    words = "learn", run, "inches.csv", "--no-draw"
    assert touchatlas(*words, cwd=tmp_path).returncode == 2
    (tmp_path / "answer.csv").write_text(answers(run))
    ran("learn", run, "answer.csv", "--no-draw", cwd=tmp_path)


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda rows: in_unit(rows, 1e-3), "the contact of the answer to plan 0 is 14.98 from"),
        (lambda rows: in_unit(rows, 25.4), "the contact of the answer to plan 0 is 366 from"),
        (lambda rows: in_unit(rows, 1e3, 15.0), "the median point of the answer to plan 0 is 1"),
    ],
    ids=["metres", "inches", "frame of the start"],
)
def test_an_answer_far_from_where_its_plan_leads_leaves_the_plan_pending(tmp_path, change, said):
    run = tmp_path / "run"
    start = "--start", "0,0,15", "--outward", "0,0,1", "--noise", "0.01", "--tolerance", "0.2"
    assert touchatlas("next", run, *start, cwd=tmp_path).returncode == 0
    head, *rows = answers(run).split("\n")
    words = "learn", run, "answer.csv", "--no-draw"
    (tmp_path / "answer.csv").write_text("\n".join([head, *change(rows)]))
    done = touchatlas(*words, cwd=tmp_path)
    assert_refused(done, 2, said)
    assert "unit" in done.stderr and list(pending_plans(run)) == [0]
    (tmp_path / "answer.csv").write_text("\n".join([head, *rows]))
    assert touchatlas(*words, cwd=tmp_path).returncode == 0


def test_a_run_that_is_there_is_not_begun_again_and_says_how_to_go_on(tmp_path):
    words = "--start", "0,0,15", "--outward", "0,0,1", "--noise", "0.01", "--tolerance", "0.2"
    assert touchatlas("next", "run", *words, cwd=tmp_path).returncode == 0
    for more in ((), ("--force",)):
        done = touchatlas("next", "run", *words, *more, cwd=tmp_path)
        assert_refused(done, 2, "touchatlas next run without these goes on with it")
        assert "--out" not in done.stderr and "--force" not in done.stderr
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").touch()
    for name, said in (
        ("other", "is not empty; name another folder"),
        ("other/mine.txt", "a file"),
    ):
        assert_refused(touchatlas("next", name, *words, cwd=tmp_path), 2, said)
    done = touchatlas("explore", "sphere", "--out", "run", cwd=tmp_path)
    assert_refused(done, 2, "touchatlas next run to go on with it")
    done = touchatlas("view", "run", cwd=tmp_path)
    assert_refused(done, 2, "touchatlas learn run FILE")


def test_a_program_does_not_replace_a_file_of_the_run(tmp_path):
    words = "--start", "0,0,15", "--outward", "0,0,1", "--noise", "0.01", "--tolerance", "0.2"
    assert touchatlas("next", "run", *words, cwd=tmp_path).returncode == 0
    before = (tmp_path / "run/plans.csv").read_bytes()
    done = touchatlas("next", "run", "--program", "run/plans.csv", "--force", cwd=tmp_path)
    assert_refused(done, 2, "run/plans.csv is a file of the run itself")
    assert (tmp_path / "run/plans.csv").read_bytes() == before
