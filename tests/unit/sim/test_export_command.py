"""touchatlas export as a user meets it."""

import json
import subprocess
import sys

import pytest

RUN = [sys.executable, "-c", "from touchatlas.sim.command.cli import main; main()"]


def touchatlas(*arguments, cwd, run=RUN):
    return subprocess.run([*run, *map(str, arguments)], cwd=cwd, capture_output=True, text=True)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    done = touchatlas("explore", "sphere", "--max-touches", 4, "--out", "a", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_export_writes_a_step_file_and_its_numbers(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    done = touchatlas("export", "a", "a.step", "--json", cwd=runs)
    assert done.returncode == 0, done.stderr
    numbers = json.loads(done.stdout)
    assert numbers["faces"] == 4 and numbers["solids"] == 0
    assert (runs / "a.step").read_bytes().startswith(b"ISO-10303-21;")
    assert touchatlas("export", "a", "a.step", cwd=runs).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere", "x.step"), "nowhere holds no atlas.npz"),
        (("a", "a/atlas.npz"), "give a file that ends in .step"),
        (("a", "missing/x.step"), "missing is not a folder"),
        (("a",), "FILE"),
    ],
)
def test_the_users_mistakes_are_one_sentence_and_exit_two(runs, arguments, words):
    done = touchatlas("export", *arguments, cwd=runs)
    assert done.returncode == 2 and not done.stdout
    assert words in done.stderr and len(done.stderr.splitlines()) == 1


def test_missing_extra_is_the_users_to_install(runs):
    script = "import sys; sys.modules['OCP'] = None; " + RUN[-1]
    done = touchatlas("export", "a", "x.step", cwd=runs, run=[*RUN[:2], script])
    assert done.returncode == 2 and "pip install touchatlas[cad]" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (runs / "x.step").exists()


def test_a_full_disk_is_a_failure(runs):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    limited = ["bash", "-c", 'ulimit -f 8; trap "" XFSZ; exec "$@"', "-", *RUN]
    done = touchatlas("export", "a", "x.step", cwd=runs, run=limited)
    assert done.returncode == 1 and "File too large" in done.stderr
    assert [p.name for p in runs.glob("x.step*")] == []


def test_help_names_the_arguments(runs):
    done = touchatlas("export", "--help", cwd=runs)
    assert done.returncode == 0 and "RUN" in done.stdout and "FILE" in done.stdout
