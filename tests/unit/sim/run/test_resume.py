"""Resuming: however a run was stopped, it ends as the run that was never stopped."""

import json
import shutil
import signal
import sqlite3
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import trimesh

from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.recorder import Recorder
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run import work
from touchatlas.sim.run.exploration import FinishedError, resume_exploration, run_exploration
from touchatlas.sim.run.interrupt import Terminated
from touchatlas.sim.run.progress import read_seconds
from touchatlas.sim.run.watcher import Watcher
from touchatlas.sim.world.objects import digest_of, make_object

pytestmark = pytest.mark.usefixtures("no_pictures", "few_judged")
WHOLE = RunOptions(max_touches=5, seed=3, tolerance=0.3)
# What must be the same, byte for byte. Pictures show seconds nowhere, tables do.
SAME = ("journal.sqlite", "atlas.npz", "surface.ply", "run.toml", "progress.png", "surface.png")


def before_settings_were_kept(run):
    """Make the journal of a run one of an earlier version."""
    with closing(sqlite3.connect(run / "journal.sqlite")) as journal:
        journal.execute("drop table setting")
        journal.commit()
    return {path.name: path.read_bytes() for path in run.iterdir() if path.name != "run.lock"}


def edited(run, old, new):
    """Change a line of run.toml; returns the files of the run."""
    text = (run / "run.toml").read_text()
    assert old in text
    (run / "run.toml").write_text(text.replace(old, new))
    return {path.name: path.read_bytes() for path in run.iterdir() if path.name != "run.lock"}


class KilledError(BaseException):
    """Ends a run as kill -9 does: nothing is caught, nothing is cleaned up."""


class Copier(Watcher):
    """Copies the folder of a run at each touch and at the beginning of each phase: what is on the
    disk then is what kill -9 leaves there."""

    def __init__(self, run):
        self.run = run

    def _copy(self, name):
        # The first of the phases that have a word in common.
        if self.run.exists() and not (copy := self.run.parent / name).exists():
            shutil.copytree(self.run, copy)

    def touched(self, step, atlas):
        self._copy(f"touch {step.plan.number}")

    def begins(self, words):
        self._copy(words.split()[0])


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("mesh") / "ball.ply"
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    mesh.apply_scale([1.0, 0.8, 0.6])
    mesh.export(path)
    return path


@pytest.fixture
def whole(ball, no_pictures, few_judged):
    folder = ball.parent / "whole"
    if not folder.exists():
        run_exploration(make_object(str(ball), 3), folder, WHOLE, watcher=Copier(folder))
    return folder


@pytest.fixture
def killed(whole, tmp_path):
    """Makes the folder of a run that was killed at a touch or at the beginning of a phase."""
    return lambda moment: shutil.copytree(whole.parent / moment, tmp_path / "r")


def assert_same(folder, whole, names=SAME):
    for name in names:
        assert (folder / name).read_bytes() == (whole / name).read_bytes(), name
    untimed = [
        {
            k: v
            for k, v in json.loads((f / "evaluation.json").read_text()).items()
            if k[:7] != "seconds"
        }
        for f in (folder, whole)
    ]
    assert untimed[0] == untimed[1]


class Killer(Watcher):
    """Kills a run at a touch."""

    def __init__(self, touch):
        self.touch = touch

    def touched(self, step, atlas):
        if step.plan.number == self.touch:
            raise KilledError


@pytest.mark.parametrize("moment", ["touch 0", "touch 3", "finishing", "comparing", "drawing"])
def test_a_killed_run_ends_as_the_one_that_was_never_stopped(whole, killed, moment):
    run = killed(moment)
    resume_exploration(run)
    assert_same(run, whole)


def test_a_run_killed_between_a_touch_and_its_learning_ends_the_same(
    ball, whole, tmp_path, monkeypatch
):
    def journal_and_die(self, plan, answer=Recorder.__call__):
        touch = answer(self, plan)
        if plan.number == 2:
            raise KilledError
        return touch

    with monkeypatch.context() as patched:
        patched.setattr(Recorder, "__call__", journal_and_die)
        with pytest.raises(KilledError):
            run_exploration(make_object(str(ball), 3), tmp_path / "r", WHOLE)
    # The touch was made, and is not lost.
    journal = Journal(tmp_path / "r" / "journal.sqlite")
    assert len(journal) == 3
    journal.close()
    resume_exploration(tmp_path / "r")
    assert_same(tmp_path / "r", whole)


def test_a_run_that_is_killed_again_while_it_is_resumed_ends_the_same(whole, killed):
    run = killed("touch 2")
    seconds = read_seconds(run / "steps.csv")
    assert len(seconds) == 3
    for touch in (1, 3):
        with pytest.raises(KilledError):
            resume_exploration(run, watcher=Killer(touch))
        # The seconds of touches are those of the process that made them.
        assert read_seconds(run / "steps.csv")[:3] == seconds
    resume_exploration(run)
    assert_same(run, whole)


def test_a_finished_run_is_extended_to_a_larger_budget(ball, whole, tmp_path):
    few = replace(WHOLE, max_touches=3)
    run_exploration(make_object(str(ball), 3), tmp_path / "r", few)
    result = resume_exploration(tmp_path / "r", max_touches=5)
    assert result.numbers["touches"] == 5 and not result.interrupted
    assert_same(tmp_path / "r", whole)


def test_an_interrupted_run_keeps_its_results_and_goes_on(ball, whole, tmp_path, monkeypatch):
    # On a busy machine the results take longer than a user would wait.
    monkeypatch.setattr(work, "GRACE", 600.0)

    class Interrupting(Watcher):
        def touched(self, step, atlas):
            if step.plan.number == 1:
                signal.raise_signal(signal.SIGTERM)

    before = signal.getsignal(signal.SIGTERM)
    result = run_exploration(
        make_object(str(ball), 3), tmp_path / "r", WHOLE, watcher=Interrupting()
    )
    assert signal.getsignal(signal.SIGTERM) is before
    assert result.interrupted and result.numbers["touches"] == 2
    resume_exploration(tmp_path / "r")
    assert_same(tmp_path / "r", whole)


@pytest.mark.parametrize(
    ("number", "end"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_an_interrupt_while_touches_are_repeated_leaves_the_files_as_they_are(killed, number, end):
    run = killed("touch 4")
    before = {p.name: p.read_bytes() for p in run.iterdir() if p.name != "run.lock"}

    class Interrupting(Watcher):
        def touched(self, step, atlas):
            signal.raise_signal(number)

        def interrupted(self, words):
            assert words == "stopping"

    with pytest.raises(KeyboardInterrupt) as stop:
        resume_exploration(run, watcher=Interrupting())
    assert stop.type is end
    assert {p.name: p.read_bytes() for p in run.iterdir()} == before


def test_results_that_take_too_long_after_an_interrupt_are_cut_short(
    ball, whole, tmp_path, monkeypatch
):
    monkeypatch.setattr(work, "GRACE", 0.05)

    class Interrupting(Watcher):
        def touched(self, step, atlas):
            if step.plan.number == 1:
                signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run_exploration(make_object(str(ball), 3), tmp_path / "r", WHOLE, watcher=Interrupting())
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
    resume_exploration(tmp_path / "r")
    assert_same(tmp_path / "r", whole)


def test_a_forced_run_replaces_the_old_one_only_when_it_is_whole(ball, whole, tmp_path):
    folder, other = tmp_path / "r", replace(WHOLE, max_touches=1, seed=0)
    run_exploration(make_object(str(ball)), folder, other)
    before = (folder / "atlas.npz").read_bytes()
    obj = make_object(str(ball), 3)
    with pytest.raises(KilledError):
        run_exploration(obj, folder, WHOLE, force=True, watcher=Killer(3))
    assert (folder / "atlas.npz").read_bytes() == before
    resume_exploration(folder)
    assert_same(folder, whole)
    assert not (folder / "replacement").exists()


def test_all_seconds_are_accounted_for(whole, killed):
    for numbers in (
        json.loads((whole / "evaluation.json").read_text()),
        resume_exploration(killed("touch 4")).numbers,
    ):
        parts = [v for k, v in numbers.items() if k[:8] == "seconds_" and k != "seconds_total"]
        # What lies between phases is a few file operations, which another process may delay: on a
        # busy machine they took 5 % once.
        assert 0.8 * numbers["seconds_total"] < sum(parts) <= 1.001 * numbers["seconds_total"]


def test_what_cannot_be_resumed_is_said(ball, whole, tmp_path):
    run = shutil.copytree(whole, tmp_path / "r")
    with pytest.raises(
        FinishedError, match="has its 5 touches; give a larger --max-touches"
    ) as end:
        resume_exploration(run)
    assert end.value.numbers["touches"] == 5
    with pytest.raises(ValueError, match="max-touches is 3, but .* holds 5"):
        resume_exploration(run, max_touches=3)
    with pytest.raises(ValueError, match="holds no run"):
        resume_exploration(tmp_path)
    (run / "journal.sqlite").write_bytes(b"junk" * 100)
    with pytest.raises(ValueError, match="is no whole journal of a run"):
        resume_exploration(run)


def test_a_mesh_that_has_changed_is_refused(ball, tmp_path):
    mine = tmp_path / "mine.ply"
    shutil.copy(ball, mine)
    with pytest.raises(KilledError):
        run_exploration(make_object(str(mine)), tmp_path / "r", WHOLE, watcher=Killer(1))
    trimesh.creation.icosphere(subdivisions=4, radius=31.0).export(mine)
    with pytest.raises(ValueError, match=r"mine.ply has changed since .* was begun"):
        resume_exploration(tmp_path / "r")


def test_a_journal_that_another_program_holds_is_the_worlds_failure(whole, tmp_path, monkeypatch):
    run = shutil.copytree(whole, tmp_path / "r")
    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, timeout=0.01))
    with closing(sqlite3.connect(run / "journal.sqlite", isolation_level=None)) as other:
        other.execute("begin exclusive")
        with pytest.raises(OSError, match=r"database is locked.*no other program has it open"):
            resume_exploration(run, max_touches=6)


@pytest.mark.parametrize("lost", [Path.unlink, lambda path: path.write_bytes(b"")])
def test_a_lost_journal_is_not_begun_again_in_silence(ball, whole, tmp_path, lost):
    run = shutil.copytree(whole, tmp_path / "r")
    lost(run / "journal.sqlite")
    with pytest.raises(ValueError, match=r"journal.sqlite holds 0 touches, but steps.csv 5"):
        resume_exploration(run, max_touches=6)
    for name in ("atlas.npz", "surface.ply", "steps.csv"):
        assert (run / name).read_bytes() == (whole / name).read_bytes()


@pytest.mark.parametrize(
    ("old", "new"),
    [("seed = 3", "seed = 4"), ("noise = ", "noise = 1"), ('ball.ply"', 'other.ply"')],
)
def test_settings_that_did_not_give_the_touches_are_refused(ball, whole, tmp_path, old, new):
    """Another seed, a larger noise, and another object of the same top; the journal is one that
    does not hold its settings."""
    run, settings = shutil.copytree(whole, tmp_path / "r"), (whole / "run.toml").read_text()
    before_settings_were_kept(run)
    assert old in settings
    changed = trimesh.load(ball)
    changed.vertices[changed.vertices[:, 2] < 29.9] *= 0.99
    changed.export(ball.parent / "other.ply")
    changed = settings.replace(old, new)
    if "other" in new:
        digest = digest_of(make_object(str(ball.parent / "other.ply")))
        changed = changed.replace(digest_of(make_object(str(ball))), digest)
    before = edited(run, settings, changed)
    with pytest.raises(ValueError, match="does not give the first touch of the journal"):
        resume_exploration(run, max_touches=6)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ("seed = 3", "seed = 4", "seed = 4, .* seed = 3"),
        ("tolerance = 0.3", "tolerance = 0.5", r"tolerance = 0.5, .* tolerance = 0.3"),
        ("facets = 0.2", "facets = 0.3", r"atlas.facets = 0.3, .* atlas.facets = 0.2"),
        ("coverage = 0.995", "coverage = 0.9", "planner.coverage = 0.9, .* 0.995"),
        ("noise = ", "# noise = ", "no noise, .* noise = "),
        ("digest = ", "# digest = ", "no digest"),
        ("bias = 0.2", "bias = 0.3", r"atlas.bias = 0.3, .* atlas.bias = 0.2"),
    ],
)
def test_other_settings_than_those_of_the_touches_are_refused_and_nothing_changes(
    whole, tmp_path, old, new, names
):
    run = shutil.copytree(whole, tmp_path / "r")
    before = edited(run, old, new)
    with pytest.raises(ValueError, match=f"{names}.* begin anew with touchatlas explore .*toml"):
        resume_exploration(run, max_touches=6)
    # Of a finished run as well, whose numbers are those of other settings.
    with pytest.raises(ValueError, match="put that back"):
        resume_exploration(run)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_a_journal_that_does_not_hold_its_settings_is_read_and_they_are_assumed(whole, tmp_path):
    said = []

    class Hearing(Watcher):
        def assumes(self, words):
            said.append(words)

    run = shutil.copytree(whole, tmp_path / "r")
    before_settings_were_kept(run)
    assert resume_exploration(run, max_touches=6, watcher=Hearing()).numbers["touches"] == 6
    assert ["those of run.toml are taken" in words for words in said] == [True]
    # From now on they are known.
    edited(run, "facets = 0.2", "facets = 0.3")
    with pytest.raises(ValueError, match="facets = 0.3"):
        resume_exploration(run, max_touches=7)


def test_a_mesh_that_was_moved_is_the_same_object(ball, whole, tmp_path):
    run = shutil.copytree(whole, tmp_path / "r")
    shutil.copy(ball, tmp_path / "moved.ply")
    edited(run, str(ball), str(tmp_path / "moved.ply"))
    assert resume_exploration(run, max_touches=6).numbers["touches"] == 6


def test_a_setting_of_a_later_version_had_its_default(whole, tmp_path):
    run = shutil.copytree(whole, tmp_path / "r")
    with closing(sqlite3.connect(run / "journal.sqlite")) as journal:
        journal.execute("delete from setting where name = 'atlas.facets'")
        journal.commit()
    edited(run, "facets = 0.2", "facets = 0.3")
    with pytest.raises(ValueError, match=r"facets = 0.3, .*facets = 0\.2"):
        resume_exploration(run, max_touches=6)


def test_a_journal_of_another_version_is_refused(killed):
    """A planner that makes other plans cannot go on with these touches."""
    run = killed("touch 3")
    text = (run / "run.toml").read_text()
    other = text.replace("curves = 3", "curves = 4")
    assert other != text
    before_settings_were_kept(run)
    before = edited(run, text, other)
    for tolerance, remedy in ((None, "resume with the versions"), (0.2, "to that tolerance")):
        with pytest.raises(ValueError, match=f"another plan than is made now; .*{remedy}"):
            resume_exploration(run, max_touches=7, tolerance=tolerance)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


@pytest.mark.slow
def test_a_known_surface_resumed_to_a_finer_tolerance_is_that_of_a_run_to_it(tmp_path):
    """Touches to a tolerance are the first of those to a finer one: the files are equal, byte for
    byte, but for the seconds. The body obeys no law, so that a finer one asks for more touches."""
    coarse, fine = (replace(WHOLE, tolerance=t, max_touches=None) for t in (5.0, 0.05))
    obj = make_object("mouse", 3)
    before = run_exploration(obj, tmp_path / "r", coarse)
    straight = run_exploration(obj, tmp_path / "fine", fine)
    after = resume_exploration(tmp_path / "r", tolerance=0.05)
    assert before.numbers["touches"] < after.numbers["touches"] == straight.numbers["touches"]
    # The journal's own count of its changes is another one.
    assert_same(tmp_path / "r", tmp_path / "fine", SAME[1:])
    with pytest.raises(FinishedError, match="known to the tolerance"):
        resume_exploration(tmp_path / "r")


def test_a_run_is_not_resumed_to_a_looser_tolerance(whole):
    files = {path.name: path.read_bytes() for path in whole.iterdir()}
    with pytest.raises(ValueError, match="tolerance is 9, looser than the .* give one below"):
        resume_exploration(whole, tolerance=9.0)
    assert {path.name: path.read_bytes() for path in whole.iterdir()} == files
