"""The command line, called in the process of the tests, so that its imports are paid once."""

import re
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from unittest.mock import patch
from warnings import catch_warnings, filterwarnings

from touchatlas.sim.command.entry import main

# The same in a process of its own.
PROCESS = [sys.executable, "-c", "from touchatlas.sim.command.entry import main; main()"]

# The same without pictures, and judged by 2,000 points each way instead of 40,000: these take most
# of the time of a short run.
UNDRAWN = [
    *PROCESS[:-1],
    "from functools import partial; "
    "from touchatlas.sim.judge.truth import EvaluateOptions; "
    "from touchatlas.sim.run import conclusion, progress; "
    "drawn = lambda *_: b'no picture'; "
    "conclusion.surface_picture = conclusion.replay_bytes = drawn; "
    "progress.Progress.png_bytes = drawn; few = EvaluateOptions(samples=2000); "
    "conclusion.truth_of = partial(conclusion.truth_of, options=few); "
    "conclusion.evaluate_surface = partial(conclusion.evaluate_surface, options=few); "
    + PROCESS[-1],
]

# A whole run of a ball, to a tolerance of 0.6 instead of 0.1: its truth has a sixth of the
# triangles.
WHOLE_RUN = ("explore", "sphere", "--tolerance", 0.6, "--noise", 0.12, "--json")


def touchatlas(*arguments, cwd) -> subprocess.CompletedProcess:
    """Exit code, standard output and standard error of a command."""
    out, errors, words = StringIO(), StringIO(), ["touchatlas", *map(str, arguments)]
    code = 0
    with (
        chdir(cwd),
        patch.object(sys, "argv", words),
        redirect_stdout(out),
        redirect_stderr(errors),
        catch_warnings(),
    ):
        # Cyclopts sees that tests run, and doubts that a command line is meant.
        filterwarnings("ignore", "Cyclopts application invoked without tokens")
        try:
            main()
        except SystemExit as end:
            code = end.code
    return subprocess.CompletedProcess(words, code, out.getvalue(), errors.getvalue())


def ran(*arguments, cwd) -> subprocess.CompletedProcess:
    """The same of a command that has to succeed."""
    done = touchatlas(*arguments, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done


def touchatlas_process(*arguments, cwd, process=PROCESS) -> subprocess.CompletedProcess:
    """What `touchatlas` gives, of a command in a process of its own."""
    return subprocess.run([*process, *map(str, arguments)], cwd=cwd, capture_output=True, text=True)


def progress_lines(errors: str) -> list[str]:
    """The lines that say how long a phase has taken so far."""
    return re.findall(r"^touchatlas: [^:\n]+: \d+ s.*$", errors, re.MULTILINE)


def assert_refused(done, code, words) -> None:
    """A command ended with this code, and its one line of error holds these words."""
    assert done.returncode == code, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) - len(progress_lines(done.stderr)) == 1, done.stderr
