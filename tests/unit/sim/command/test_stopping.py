"""What stops a command from outside: signals, full disks, read-only folders, other processes."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import closing, suppress

import psutil
import pytest

from tests.command import PROCESS, UNDRAWN, assert_refused, progress_lines, ran, touchatlas
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.run_folder import old_run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and file locks of POSIX")
RUN = ("explore", "sphere", "--tolerance", "0.6", "--max-touches", "12", "--out", "r")


def start(*words, cwd, process=PROCESS):
    return subprocess.Popen(
        [*process, *words], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for(condition, process):
    while process.poll() is None and not condition():
        time.sleep(0.002)


def touches_in(folder):
    if not (folder / "journal.sqlite").exists():
        return 0
    with closing(Journal(folder / "journal.sqlite")) as journal:
        return len(journal)


def rows_in(folder):
    """Touches that steps.csv has: the journal is not asked, because who opens one while it is made
    disturbs it."""
    path = folder / "steps.csv"
    return max(len(path.read_text().splitlines()) - 1, 0) if path.exists() else 0


# A process that says when Python and the entry point are there: before, Ctrl-C is Python's own.
def telling(process):
    return [*process[:-1], process[-1].replace("main()", "print('up', flush=True); main()")]


# While it imports, and while it touches, which one without pictures does half a second after it has
# imported all; the others, between these, in the long studies.
MOMENTS = [(0.02, PROCESS), (0.2, PROCESS), (0.6, PROCESS), (1.1, PROCESS), (0.5, UNDRAWN)]
BETWEEN = [(seconds, PROCESS) for seconds in (0.05, 0.1, 0.4, 0.8, 1.6, 2.4)]


@pytest.mark.parametrize(
    ("seconds", "process"), [*MOMENTS, *(pytest.param(*x, marks=pytest.mark.slow) for x in BETWEEN)]
)
def test_ctrl_c_at_many_moments_is_no_traceback_and_ends_the_touching(tmp_path, seconds, process):
    """After it no touch begins. One may have ended between the count and the signal, and one is
    finished. The clock tells nothing here: other tests share the machine."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*telling(process), *RUN], cwd=tmp_path, stdout=pipe, stderr=pipe, text=True
    ) as run:
        assert run.stdout.readline() == "up\n"
        time.sleep(seconds)
        before = rows_in(tmp_path / "r")
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=60)
    assert "Traceback" not in errors and run.returncode in (0, 130), errors
    assert rows_in(tmp_path / "r") <= before + 2
    assert not list(tmp_path.glob("r/*.part")) and not (tmp_path / "r" / "run.lock").exists()


@pytest.mark.parametrize(
    ("number", "code"),
    [
        pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow),
        (signal.SIGTERM, 143),
    ],
)
def test_a_signal_names_what_it_waits_for_and_how_to_go_on(tmp_path, number, code):
    """With many touches to go the signal comes while it touches."""
    words = ["explore", "blob", "--tolerance", "1", "--out", "r"]
    with start(*words, cwd=tmp_path, process=UNDRAWN) as process:
        wait_for((tmp_path / "r" / "journal.sqlite").exists, process)
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == code, errors
    assert "finishing touch" in errors and "touchatlas resume r" in errors


def begun_by(process):
    """Command lines of the processes that a process has begun."""
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        with suppress(psutil.Error):
            found.append(" ".join(child.cmdline()))
    return found


@pytest.mark.parametrize("command", ["study", pytest.param("paper", marks=pytest.mark.slow)])
@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_ctrl_c_while_workers_start_is_one_sentence(tmp_path, command, times):
    """A terminal sends it to all processes. Workers import for a second when they are begun."""
    text = 'objects = ["sphere"]\n[options]\nmax_touches = 1\ntolerance = 2.0\n'
    (tmp_path / "s.toml").write_text(text)
    words = {"study": ["study", "s.toml"], "paper": ["paper"]}[command]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*PROCESS, *words, "--workers", "2"],
        cwd=tmp_path,
        stdout=pipe,
        stderr=pipe,
        text=True,
        start_new_session=True,
    ) as process:
        wait_for(lambda: any("spawn_main" in line for line in begun_by(process)), process)
        for _ in range(times):
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.1)
        _, errors = process.communicate(timeout=60)
    lines = [line for line in errors.splitlines() if line not in progress_lines(errors)]
    assert process.returncode == 130 and len(lines) == 1, errors
    assert "what was measured is kept, and the same command goes on" in lines[0]


def test_a_second_process_is_refused_with_the_number_of_the_first(tmp_path):
    """The first stands still meanwhile, and holds its run."""
    with start("explore", "sphere", "--out", "r", cwd=tmp_path) as first:
        wait_for((tmp_path / "r" / "steps.csv").exists, first)
        first.send_signal(signal.SIGSTOP)
        again = ["explore", "sphere", "--out", "r"]
        for words in (again, [*again, "--force"], ["resume", "r"]):
            done = touchatlas(*words, cwd=tmp_path)
            assert_refused(done, 2, f"process {first.pid} is at work in r")
        first.send_signal(signal.SIGKILL)
        first.communicate()
    # The lock goes with its process.
    with old_run(tmp_path / "r") as folder:
        assert folder == tmp_path / "r"


@pytest.mark.slow
def test_two_processes_that_start_at_once_do_not_disturb_each_other(tmp_path):
    few = [*RUN[:5], "2", *RUN[6:]]
    both = [start(*few, cwd=tmp_path) for _ in range(2)]
    ends = [(p.communicate(timeout=120)[1], p.returncode) for p in both]
    codes = sorted(code for _, code in ends)
    assert codes == [0, 2], ends
    refusal = next(errors for errors, code in ends if code == 2)
    assert "at work in r" in refusal or "already holds a run" in refusal
    assert touches_in(tmp_path / "r") == 2


@pytest.mark.usefixtures("no_pictures", "few_judged")
@pytest.mark.skipif(os.geteuid() != 0, reason="mounting takes root")
def test_a_disk_that_fills_up_keeps_the_touches_and_the_run_is_resumed(tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=80k", "tmpfs", str(small)], capture_output=True
    )
    if mounted.returncode:
        pytest.skip("no tmpfs can be mounted here")
    try:
        words = ["sphere", "--tolerance", 0.3, "--max-touches", 12, "--out", small / "r"]
        done = touchatlas("explore", *words, cwd=tmp_path)
        assert done.returncode == 1, done.stderr
        others = set(done.stderr.splitlines()) - set(progress_lines(done.stderr))
        assert len(others) == 1 and "space" in others.pop(), done.stderr
        count = touches_in(small / "r")
        assert count > 2
        assert not list((small / "r").glob("*.part"))
        shutil.copytree(small / "r", tmp_path / "r")
    finally:
        subprocess.run(["umount", str(small)], check=True)
    done = ran("resume", "r", "--max-touches", count + 1, "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["touches"] == touches_in(tmp_path / "r") == count + 1


def test_a_run_that_is_read_only_is_left_as_it_is(whole_run, monkeypatch):
    """Root may write anywhere: the refusal of the file system stands in for a real one."""

    def refuse(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    run = whole_run[0]
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    forced = ["explore", "sphere", "--force", "--out", run]
    for words in (["resume", run, "--max-touches", 99], forced):
        done = touchatlas(*words, cwd=run.parent)
        assert_refused(done, 1, f"{run}: Read-only file system; see who may read and write there")
        assert "goes on" not in done.stderr
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before
