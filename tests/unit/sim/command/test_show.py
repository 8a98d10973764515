"""What a command says while it works: every phase that is slow, and nothing of quick ones."""

import io
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from tests.command import progress_lines
from touchatlas.sim.command import show
from touchatlas.sim.command.show import Bar, PlainLines, shown


@pytest.fixture
def hasty(monkeypatch):
    """Phases show themselves after a twentieth of the time."""
    wait = PlainLines._wait
    monkeypatch.setattr(PlainLines, "_wait", lambda self, seconds: wait(self, seconds / 20.0))


def test_slow_phases_show_themselves_in_plain_lines_and_quick_ones_do_not(hasty, capsys):
    with shown("reading") as watcher:
        time.sleep(0.15)
        watcher.begins("thinking")
        watcher.begins("working")
        watcher.note("half done")
        time.sleep(0.4)
        watcher.begins("writing")
    time.sleep(0.15)
    out, errors = capsys.readouterr()
    lines = progress_lines(errors)
    assert out == "" and len(lines) == len(errors.splitlines())
    assert [line.split(":")[1] for line in lines] == [" reading", *[" working"] * (len(lines) - 1)]
    assert len(lines) >= 2 and lines[1].endswith("half done")


def test_lines_of_two_threads_are_written_in_one_piece(monkeypatch):
    """What is said while a line of progress is written is not glued to it."""
    pieces = []
    stream = SimpleNamespace(write=pieces.append, flush=lambda: None)
    monkeypatch.setattr(show.sys, "stderr", stream)
    lines = PlainLines()
    lines.words = "reading"
    lines._say()
    lines.end()
    lines.assumes("this and that")
    assert len(pieces) == 2 and all(piece.endswith("\n") for piece in pieces)
    assert progress_lines(pieces[0]) and pieces[1] == "touchatlas: this and that\n"


def test_an_interrupt_says_what_was_left(hasty):
    with pytest.raises(KeyboardInterrupt) as stop, shown("reading") as watcher:
        watcher.begins("comparing")
        raise KeyboardInterrupt
    assert stop.value.__notes__ == ["this was left, and all that comes after it: comparing"]


def test_a_bar_has_a_line_for_each_phase():
    console = Console(file=io.StringIO(), force_terminal=True, width=100)
    with show.Progress(*show.Progress.get_default_columns(), console=console) as progress:
        bar = Bar(progress)
        bar.begins("touching")
        bar.note("touch 3", 0.5)
        bar.begins("drawing")
        assert [task.description for task in progress.tasks] == ["touching", "drawing"]
        assert progress.tasks[0].finished
    assert "drawing" in console.file.getvalue()
