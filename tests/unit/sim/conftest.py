"""What the tests of the sim share: a whole run, of which each test gets its own copy."""

import pickle
import signal
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.command import WHOLE_RUN, progress_lines, ran
from tests.kept import kept_once
from touchatlas.sim.judge.truth import EvaluateOptions
from touchatlas.sim.run import conclusion
from touchatlas.sim.run.progress import Progress
from touchatlas.sim.study import study
from touchatlas.sim.study.workers import Here


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
    monkeypatch.setattr(conclusion, "replay_bytes", drawn)
    monkeypatch.setattr(Progress, "png_bytes", drawn)


@pytest.fixture
def few_judged(monkeypatch):
    """Runs are judged by 2,000 points each way, a twentieth of the usual number."""
    few = EvaluateOptions(samples=2000)
    monkeypatch.setattr(conclusion, "truth_of", partial(conclusion.truth_of, options=few))
    judge = partial(conclusion.evaluate_surface, options=few)
    monkeypatch.setattr(conclusion, "evaluate_surface", judge)


class _Pickled(Here):
    """Measures in this process; what it gets and gives is pickled all the same."""

    def answers(self, measure, given):
        """Keys and answers."""
        measure, given = pickle.loads(pickle.dumps((measure, given)))
        return pickle.loads(pickle.dumps(list(super().answers(measure, given))))


@pytest.fixture(scope="module")
def no_processes():
    """Studies work in this process: others would import everything first."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "workers", lambda *_: nullcontext(_Pickled()))
        yield


@kept_once
def _whole_run() -> tuple[dict[str, bytes], str]:
    """The files of a whole run, and what the command printed."""
    with TemporaryDirectory() as folder:
        done = ran(*WHOLE_RUN, "--out", "run", cwd=folder)
        assert set(done.stderr.splitlines()) == set(progress_lines(done.stderr)), done.stderr
        files = {path.name: path.read_bytes() for path in Path(folder, "run").iterdir()}
    return files, done.stdout


@pytest.fixture(scope="session")
def whole_run_in():
    """Writes the files of a whole run into a new folder; returns it and what the command
    printed."""

    def write(folder: Path) -> tuple[Path, str]:
        files, printed = _whole_run()
        folder.mkdir()
        for name, data in files.items():
            (folder / name).write_bytes(data)
        return folder, printed

    return write


@pytest.fixture
def whole_run(whole_run_in, tmp_path):
    """A copy of the folder of a whole run, and what the command printed."""
    return whole_run_in(tmp_path / "whole")
