"""The run folder: what --force takes and what it never touches, and the settings read back."""

import os
import sys

import pytest

from touchatlas.sim.folder import run_folder
from touchatlas.sim.folder.run_folder import (
    RUN_FILES,
    new_run,
    old_run,
    read_finished,
    read_settings,
    replace_run,
    write_settings,
)
from touchatlas.sim.folder.run_lock import LOCK

GOOD = {"object": "sphere", "tolerance": 0.1, "seed": 0}


@pytest.fixture
def run(tmp_path):
    """A folder with every file of a run."""
    folder = tmp_path / "run"
    folder.mkdir()
    for name in RUN_FILES:
        (folder / name).write_text("x")
    write_settings(folder, GOOD)
    return folder


def taken(path, force):
    """The folder that a new run would write to."""
    with new_run(path, force) as folder:
        return folder


def names_in(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["surface.ply", "run.toml"])
def test_force_takes_no_folder_that_is_not_a_run(tmp_path, name):
    (tmp_path / "surface.ply").write_text("my own scan")
    (tmp_path / name).write_text("mine = true")
    with pytest.raises(ValueError, match=f"holds .*{name}.*of no run"):
        taken(tmp_path, force=True)
    assert (tmp_path / name).read_text() == "mine = true"


MINE = {"notes.txt", ".writable", "surface.ply.bak"}


def replacement_of(run, names):
    """A whole run that is to replace another one."""
    with new_run(run, force=True) as folder:
        assert folder == run / "replacement"
        for name in names:
            (folder / name).write_text("new")
        write_settings(folder, GOOD)
        return folder


def test_a_whole_run_replaces_the_files_of_the_old_one_and_nothing_else(run):
    for name in (*MINE, "journal.sqlite-journal", "atlas.npz.part"):
        (run / name).write_text("x")
    folder = replacement_of(run, {"journal.sqlite", "steps.csv"})
    # Until it is whole, the old run is there.
    assert set(RUN_FILES) < names_in(run) and (run / "journal.sqlite").read_text() == "x"
    assert replace_run(folder) == run
    assert names_in(run) == MINE | {"run.toml", "journal.sqlite", "steps.csv"}
    assert (run / "journal.sqlite").read_text() == "new"


@pytest.mark.parametrize("moves", range(10))
def test_a_crash_while_a_run_is_replaced_is_made_good(run, monkeypatch, moves):
    """After any number of moves the next who takes the folder moves the rest."""
    (run / "notes.txt").write_text("x")
    folder = replacement_of(run, {"journal.sqlite", "steps.csv", "atlas.npz"})
    left = iter(range(moves))

    def crash(source, target, move=run_folder.os.replace):
        if next(left, None) is None:
            raise KeyboardInterrupt
        move(source, target)

    monkeypatch.setattr(run_folder.os, "replace", crash)
    try:
        replace_run(folder)
    except KeyboardInterrupt:
        assert moves < 4
    monkeypatch.undo()
    with old_run(run) as taken_again:
        assert taken_again == run
    assert names_in(run) == {"notes.txt", "run.toml", "journal.sqlite", "steps.csv", "atlas.npz"}
    assert {(run / name).read_text() for name in ("journal.sqlite", "steps.csv")} == {"new"}


def test_a_run_that_was_to_replace_another_is_the_one_that_is_gone_on_with(run):
    folder = replacement_of(run, {"journal.sqlite"})
    for path in (run, folder):
        with old_run(path) as taken_again:
            assert taken_again == folder


def test_a_folder_of_the_users_named_replacement_is_not_touched(run):
    (run / "replacement").mkdir()
    (run / "replacement" / "mine.txt").write_text("x")
    with pytest.raises(ValueError, match="holds replacement, of no run"):
        taken(run, force=True)
    assert names_in(run) == {*RUN_FILES, "replacement"}


@pytest.mark.skipif(sys.platform == "win32", reason="no flock")
def test_the_lock_of_a_killed_process_is_nobodys(tmp_path):
    (tmp_path / LOCK).write_text("12345")
    with new_run(tmp_path, force=False):
        assert (tmp_path / LOCK).read_text() == f"{os.getpid()}\n"
    assert names_in(tmp_path) == set()


def test_force_that_cannot_replace_all_removes_nothing(run):
    (run / "atlas.npz").unlink()
    (run / "atlas.npz").mkdir()
    with pytest.raises(ValueError, match="holds atlas.npz, of no run"):
        taken(run, force=True)
    assert names_in(run) == set(RUN_FILES)


def test_a_folder_that_holds_something_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="is not empty; choose another --out"):
        taken(tmp_path, force=False)
    assert taken(tmp_path, force=True) == tmp_path
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_broken_link_is_refused(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="broken link"):
        taken(tmp_path / "link", force=False)


def test_settings_come_back_with_the_versions(run):
    settings = read_settings(run)
    assert settings | GOOD == settings
    assert {"python", "touchatlas", "numpy"} <= set(settings["versions"])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("object", 3),
        ("tolerance", "a"),
        ("tolerance", -1.0),
        ("tolerance", float("nan")),
        ("seed", -1),
        ("seed", True),
        ("seed", None),
    ],
)
def test_settings_without_their_proper_values_are_refused(run, name, value):
    write_settings(run, GOOD | {name: value})
    with pytest.raises(ValueError, match=f"run.toml lacks a proper {name}; explore again"):
        read_settings(run)


def test_settings_that_are_no_toml_are_refused(run):
    (run / "run.toml").write_text("object = ")
    with pytest.raises(ValueError, match="run.toml cannot be read .*explore again"):
        read_settings(run)


def test_a_run_that_did_not_finish_is_told_from_no_run(run):
    (run / "surface.ply").unlink()
    with pytest.raises(ValueError, match="a run without a surface.ply; touchatlas resume"):
        read_finished(run)
    (run / "run.toml").unlink()
    with pytest.raises(ValueError, match="not the folder of a run"):
        read_settings(run)
