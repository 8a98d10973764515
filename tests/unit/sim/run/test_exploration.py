"""A run: what is kept, what is never lost, what is refused."""

import csv
import json
import signal
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing

import numpy as np
import pytest
import trimesh

from tests.command import assert_refused
from touchatlas.atlas import Atlas, learn, load_atlas
from touchatlas.planner import Planner
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.run_folder import RUN_FILES, read_settings
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run import work
from touchatlas.sim.run.conclusion import truth_of
from touchatlas.sim.run.exploration import resume_exploration, run_exploration
from touchatlas.sim.run.watcher import Watcher
from touchatlas.sim.run.work import random_streams
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.objects import make_object

pytestmark = pytest.mark.usefixtures("no_pictures", "few_judged")
FEW = RunOptions(max_touches=7, tolerance=0.3)


class Called(Watcher):
    """Calls a function after each touch."""

    def __init__(self, call):
        self.touched = call


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    mesh.apply_scale([1.0, 0.8, 0.6])
    return MeshObject("ball", np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.fixture(scope="module")
def finished(ball, tmp_path_factory):
    folder, touches = tmp_path_factory.mktemp("runs") / "a", []
    result = run_exploration(
        ball, folder, FEW, watcher=Called(lambda step, _: touches.append(step.touch))
    )
    return folder, result, touches


def kept_touches(folder):
    with closing(Journal(folder / "journal.sqlite")) as journal:
        return journal.touches()


def steps_of(folder):
    return list(csv.DictReader((folder / "steps.csv").read_text().splitlines()))


def test_an_object_that_has_a_unit_takes_no_other(tmp_path):
    with pytest.raises(
        ValueError, match="unit is m, but sphere is in mm; give all lengths in mm, "
    ):
        run_exploration(make_object("sphere"), tmp_path / "r", RunOptions(unit="m"))
    with pytest.raises(ValueError, match="unit is 'parsec'; it must be one of"):
        RunOptions(unit="parsec")
    assert not (tmp_path / "r").exists()


def test_every_touch_is_committed_before_the_next_is_planned(ball, tmp_path):
    seen = []

    def watch(step, _atlas):
        with closing(sqlite3.connect(tmp_path / "r" / "journal.sqlite")) as other:
            seen.append(other.execute("select count(*) from touch").fetchone()[0])

    run_exploration(ball, tmp_path / "r", FEW, watcher=Called(watch))
    assert seen == [1, 2, 3, 4, 5, 6, 7]


def test_steps_have_the_contracts_columns_and_add_up(finished):
    folder, result, touches = finished
    rows = steps_of(folder)
    text = "touch reason x y z contours tracked_length travel_length patches predicted_deviation"
    contract = [*text.split(), "coverage", "completeness_mean", "seconds_plan", "seconds_fit"]
    assert list(rows[0])[: len(contract)] == contract
    assert [int(row["touch"]) for row in rows] == list(range(7))
    # Sums in the same order: no rounding to allow for.
    assert float(rows[-1]["tracked_length"]) == sum(t.tracked_length for t in touches)
    assert float(rows[-1]["travel_length"]) == result.numbers["travel_length"]


def test_true_progress_is_looked_at_every_fifth_touch_and_at_the_last(finished, ball):
    rows = steps_of(finished[0])
    assert [i for i, row in enumerate(rows) if row["coverage"] != ""] == [0, 5, 6]
    # By another route: the touches learned again, seen at other points. Four deviations of two
    # samples of 2,000.
    atlas = Atlas(finished[1].atlas.tolerance, scale=finished[1].atlas.scale)
    for touch in kept_touches(finished[0]):
        atlas.add(touch)
    points, _ = ball.sample(2000, np.random.default_rng(9))
    fraction = (np.abs(atlas.blend(points).distance) <= 3.0 * atlas.tolerance).mean()
    assert float(rows[-1]["coverage"]) == pytest.approx(fraction, abs=4 * np.sqrt(2 * 0.25 / 2000))


def test_settings_survive_numpy_numbers_and_any_name(ball, tmp_path):
    odd = MeshObject("odd", ball.vertices, ball.faces)
    odd.source = 'a "quoted" 😀 Infinity\\name'
    options = RunOptions(
        noise=np.float64(1e-5), tolerance=np.float64(0.1), max_touches=np.int64(1), seed=np.int64(3)
    )
    run_exploration(odd, tmp_path / "r", options)
    settings = read_settings(tmp_path / "r")
    assert settings["object"] == odd.source
    assert (settings["noise"], settings["tolerance"], settings["seed"]) == (1e-5, 0.1, 3)


def test_an_interrupt_in_the_midst_of_a_touch_lets_it_finish(ball, tmp_path, monkeypatch):
    enter, sent = learn.enter_samples, []

    def interrupted(state, *rest):
        if state.touches == 2 and not sent:
            sent.append(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        return enter(state, *rest)

    monkeypatch.setattr(learn, "enter_samples", interrupted)
    # On a busy machine the results take longer than a user would wait.
    monkeypatch.setattr(work, "GRACE", 600.0)
    before = signal.getsignal(signal.SIGINT)
    result = run_exploration(ball, tmp_path / "r", FEW)
    assert signal.getsignal(signal.SIGINT) is before
    assert result.interrupted
    # The atlas knows exactly what the journal holds.
    touches = kept_touches(tmp_path / "r")
    assert result.atlas.touches == len(touches) == 3
    assert result.atlas.point_count == sum(len(c.points) for t in touches for c in t.contours)
    result.atlas.validate()
    assert {path.name for path in (tmp_path / "r").iterdir()} == set(RUN_FILES)


def interrupted_twice():
    for _ in range(2):
        signal.raise_signal(signal.SIGINT)


def failing():
    raise RuntimeError("watcher")


@pytest.mark.parametrize(
    ("end", "error"), [(interrupted_twice, KeyboardInterrupt), (failing, RuntimeError)]
)
def test_a_run_that_ends_at_once_loses_no_touch(ball, tmp_path, end, error):
    """A second interrupt, or a watcher that fails."""

    def watch(step, _atlas):
        if step.plan.number == 2:
            end()

    with pytest.raises(error):
        run_exploration(ball, tmp_path / "r", FEW, watcher=Called(watch))
    assert len(kept_touches(tmp_path / "r")) == len(steps_of(tmp_path / "r")) == 3


def test_a_run_works_in_a_thread(ball, tmp_path):
    results = []
    worker = threading.Thread(
        target=lambda: results.append(
            run_exploration(ball, tmp_path / "r", RunOptions(max_touches=1))
        )
    )
    worker.start()
    worker.join()
    assert results[0].numbers["touches"] == 1


class OutOfReach(MeshObject):
    """A ball that is looked for where it is not."""

    def start(self):
        point, up = super().start()
        return point + [1000.0, 0.0, 0.0], up


def test_a_run_that_meets_nothing_says_so_in_every_field(ball, finished, tmp_path):
    lost = OutOfReach("lost", ball.vertices, ball.faces)
    result = run_exploration(lost, tmp_path / "r", FEW)
    text = (tmp_path / "r" / "evaluation.json").read_text()
    # Strict JSON has no word for NaN or infinity.
    numbers = json.loads(text, parse_constant=pytest.fail)
    assert numbers == result.numbers
    assert set(numbers) == set(finished[1].numbers)
    assert numbers["coverage"] == 0.0 and numbers["hausdorff"] is None
    assert "inf" not in (tmp_path / "r" / "steps.csv").read_text()


def test_streams_of_one_seed_are_their_own(tmp_path):
    draws = [stream.normal(size=4) for seed in (0, 1) for stream in random_streams(seed)]
    assert len({draw.tobytes() for draw in draws}) == 8
    assert (random_streams(0)[1].normal(size=4) == draws[1]).all()


FULL_DISK = """
import resource, sys
limit = int(sys.argv.pop())
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
from touchatlas.sim.command.entry import main
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no file size limit to play a full disk")
@pytest.mark.parametrize(
    ("limit", "touches", "words"),
    [(34_000, 100, "touches; all is kept"), (61_440, 3, "r/surface.ply: File too large; see")],
    ids=["journal", "surface"],
)
def test_a_full_disk_is_one_sentence_and_keeps_what_was_committed(
    ball, tmp_path, limit, touches, words
):
    """Of three touches journal and atlas are smaller than 60 kB, and the surface is not."""
    trimesh.Trimesh(ball.vertices, ball.faces).export(tmp_path / "ball.ply")
    few = ["explore", "ball.ply", "--out", "r", "--max-touches", str(touches), str(limit)]
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, *few], cwd=tmp_path, capture_output=True, text=True
    )
    assert_refused(done, 1, words)
    count = len(kept_touches(tmp_path / "r"))
    assert 1 < count <= touches and len(steps_of(tmp_path / "r")) == count
    # Whole or not at all: nothing half written is left.
    assert not list((tmp_path / "r").glob("*.part"))


def test_a_seed_may_be_as_long_as_it_likes():
    seed = RunOptions(seed=10**400).seed
    assert random_streams(seed)[0].normal() != random_streams(0)[0].normal()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (RunOptions(noise=1e6), "noise is 1e.06, more than 1000 times the tolerance"),
        (RunOptions(tolerance=1e-9), "noise is .*, more than 1000 times the tolerance 1e-09"),
        (RunOptions(tolerance=1e-6, noise=0.0), "give a --tolerance of 0.00069 or more, or a bu"),
        (RunOptions(tolerance=1e-300), "give a --tolerance of 8.5e-11 or more"),
        (RunOptions(tolerance=1e300), "the object is only 84.85 across"),
    ],
)
def test_what_no_surface_can_come_of_is_refused_before_a_file_is_written(
    ball, tmp_path, options, words
):
    with pytest.raises(ValueError, match=words):
        run_exploration(ball, tmp_path / "r", options)
    assert not (tmp_path / "r").exists()


def test_the_judge_wants_a_tolerance(ball):
    with pytest.raises(ValueError, match="tolerance is -1"):
        truth_of(ball, -1.0, np.random.default_rng(0))


def test_a_name_is_no_object(tmp_path):
    with pytest.raises(ValueError, match="got 'sphere' for the object; give what make_object"):
        run_exploration("sphere", tmp_path / "r")


def test_an_exploration_that_is_cut_short_while_it_touches_keeps_its_atlas(tmp_path, monkeypatch):
    """The third touch never ends: the atlas of the first two is there, and resume goes on."""
    ask = Planner.ask

    def cut_short(planner, atlas):
        plan = ask(planner, atlas)
        if plan.number == 2:
            raise KeyboardInterrupt
        return plan

    obj, options = make_object("sphere"), RunOptions(tolerance=0.6, noise=0.12, max_touches=3)
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(Planner, "ask", cut_short)
        run_exploration(obj, tmp_path / "r", options)
    atlas = load_atlas(tmp_path / "r" / "atlas.npz")
    assert atlas.touches == 2 and len(atlas)
    atlas.validate()
    assert resume_exploration(tmp_path / "r").numbers["touches"] == 3
