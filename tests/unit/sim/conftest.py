"""What the tests of the sim share: a whole run, of which each test gets its own copy."""

import shutil
import signal

import pytest

from tests.command import WHOLE_RUN, touchatlas


@pytest.fixture(autouse=True)
def interruptible():
    """Ctrl-C works as at a terminal, even where the tests were started in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def _whole_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    done = touchatlas(*WHOLE_RUN, "--out", "run", cwd=folder)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return folder / "run", done.stdout


@pytest.fixture
def whole_run(_whole_run, tmp_path):
    """A copy of the folder of a whole run, and what the command printed."""
    folder, printed = _whole_run
    return shutil.copytree(folder, tmp_path / "whole"), printed
