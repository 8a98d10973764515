"""Where results cannot be written: every command that writes says so with the same exit code."""

import os
import shutil
import sys

import numpy as np
import pytest

from tests.command import touchatlas
from touchatlas.sim.command.cli import app

# A file system in which nobody makes anything, not even root.
NOWHERE = "/sys/none"
WRITING = {
    "explore": ("explore", "sphere", "--tolerance", 2, "--max-touches", 1, "--out"),
    "learn": ("learn", "curves.csv", "--approach", "0,0,1", "--out"),
    "compare": ("compare", "a", "b", "--out"),
    "fit": ("fit", "curves.csv", "--out"),
    "regions": ("regions", "a", "--workers", 0, "--out"),
    "study": ("study", "study.toml", "--workers", 0, "--out"),
    "chart": ("chart", "--draws", 1, "--workers", 0, "--out"),
    "paper": ("paper", "--draws", 1, "--workers", 0, "--out"),
    "qualify": ("qualify", "trigger", "--ball", 12, "--out"),
}


@pytest.fixture
def there(whole_run, tmp_path):
    """A folder with what the commands read."""
    for name in ("a", "b"):
        shutil.copytree(whole_run[0], tmp_path / name)
    (tmp_path / "study.toml").write_text('objects = ["sphere"]\n')
    along = np.linspace(-0.2, 0.2, 41)
    lines = ["curve,x,y,z"]
    for k, angle in enumerate(np.pi / 3.0 * np.arange(3)):
        across = 30.0 * np.sin(along)
        points = np.stack([across * np.cos(angle), across * np.sin(angle), 30.0 * np.cos(along)], 1)
        lines += [f"{k},{x},{y},{z}" for x, y, z in points]
    (tmp_path / "curves.csv").write_text("\n".join(lines))
    return tmp_path


def test_every_command_with_an_out_is_among_them(tmp_path):
    names = [name for name in app if not name.startswith("-")]
    helped = {name: touchatlas(name, "--help", cwd=tmp_path).stdout for name in names}
    assert {name for name, words in helped.items() if "--out " in words} == WRITING.keys()


@pytest.mark.skipif(not os.path.isdir("/sys/kernel"), reason="no such file system here")
@pytest.mark.parametrize("command", WRITING)
def test_a_place_that_may_not_be_written_is_a_failure(there, command):
    done = touchatlas(*WRITING[command], NOWHERE, cwd=there)
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and last.startswith(f"touchatlas: {NOWHERE}: "), done.stderr
    assert last.endswith("see who may read and write there") and "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="another error there")
@pytest.mark.parametrize("command", WRITING)
def test_a_place_in_a_file_is_the_users_mistake(there, command):
    done = touchatlas(*WRITING[command], "curves.csv/r", cwd=there)
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 2 and "curves.csv" in last and "Traceback" not in done.stderr
    assert "choose another --out" in last or "give another" in last
