"""What the tests of the sim share: a whole run, of which each test gets its own copy."""

import shutil
import signal

import pytest

from tests.command import WHOLE_RUN, progress_lines, touchatlas
from touchatlas.sim.run import conclusion
from touchatlas.sim.run.progress import Progress


@pytest.fixture(autouse=True)
def interruptible():
    """Ctrl-C works as at a terminal, even where the tests were started in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def no_pictures(monkeypatch):
    """Runs draw nothing, which takes most of the time of a short one."""
    drawn = lambda *_: b"no picture"  # noqa: E731
    monkeypatch.setattr(conclusion, "surface_picture", drawn)
    monkeypatch.setattr(Progress, "png_bytes", drawn)


@pytest.fixture(scope="session")
def _whole_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    done = touchatlas(*WHOLE_RUN, "--out", "run", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert set(done.stderr.splitlines()) == set(progress_lines(done.stderr)), done.stderr
    return folder / "run", done.stdout


@pytest.fixture
def whole_run(_whole_run, tmp_path):
    """A copy of the folder of a whole run, and what the command printed."""
    folder, printed = _whole_run
    return shutil.copytree(folder, tmp_path / "whole"), printed
