"""The run folder: what --force takes and what it never touches, and the settings read back."""

import errno

import pytest

from touchatlas.sim.run import run_folder
from touchatlas.sim.run.run_folder import RUN_FILES, create_folder, read_settings, write_settings

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


def names_in(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["surface.ply", "run.toml"])
def test_force_takes_no_folder_that_is_not_a_run(tmp_path, name):
    (tmp_path / "surface.ply").write_text("my own scan")
    (tmp_path / name).write_text("mine = true")
    with pytest.raises(ValueError, match=f"holds .*{name}.*of no run"):
        create_folder(tmp_path, force=True)
    assert (tmp_path / name).read_text() == "mine = true"


def test_force_removes_a_runs_files_and_leftovers_only(run):
    mine = {"notes.txt", ".writable", "surface.ply.bak"}
    for name in (*mine, "journal.sqlite-journal", "atlas.npz.part"):
        (run / name).write_text("x")
    create_folder(run, force=True)
    assert names_in(run) == mine


def test_force_that_cannot_replace_all_removes_nothing(run):
    (run / "atlas.npz").unlink()
    (run / "atlas.npz").mkdir()
    with pytest.raises(ValueError, match="holds atlas.npz, of no run"):
        create_folder(run, force=True)
    assert names_in(run) == set(RUN_FILES)


def test_a_folder_that_holds_something_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="is not empty; choose another --out"):
        create_folder(tmp_path, force=False)
    assert create_folder(tmp_path, force=True) == tmp_path
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_broken_link_is_refused(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="broken link"):
        create_folder(tmp_path / "link", force=False)


def test_a_folder_that_cannot_be_made_is_the_worlds_failure(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        create_folder(tmp_path / "file" / "run", force=False)


def test_a_folder_that_cannot_be_written_is_named_and_loses_nothing(run, monkeypatch):
    def refuse(dir):
        raise PermissionError(errno.EACCES, "Permission denied", f"{dir}/tmp1234")

    monkeypatch.setattr(run_folder.tempfile, "TemporaryFile", refuse)
    with pytest.raises(PermissionError) as caught:
        create_folder(run, force=True)
    assert caught.value.filename == str(run)
    assert names_in(run) == set(RUN_FILES)


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
    with pytest.raises(ValueError, match="a run without a surface.ply"):
        read_settings(run)
    (run / "run.toml").unlink()
    with pytest.raises(ValueError, match="not the folder of a run"):
        read_settings(run)
