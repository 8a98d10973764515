"""How commands end."""

import errno

import pytest
from cyclopts import CycloptsError

from touchatlas.sim.command.outcome import exit_code, named_by_flags
from touchatlas.sim.run.interrupt import Terminated


def raising(error):
    def command():
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (ValueError("noise is\n -1"), 2, "noise is -1"),
        (CycloptsError(msg="odd"), 2, "odd"),
        (CycloptsError(msg="There are: a, b, ..."), 2, "There are: a, b; see touchatlas --help"),
        (OSError(errno.EACCES, "No", "run.toml"), 1, "run.toml: No; see who may read and write"),
        (OSError(errno.ENOSPC, "Full", "a"), 1, "a: Full; see that there is space"),
        (OSError(errno.EISDIR, "Is a directory", "a"), 1, "a: Is a directory\n"),
        (OSError("in our own words"), 1, "in our own words"),
        (MemoryError(), 1, "out of memory"),
        (KeyboardInterrupt(), 130, "stopped"),
        (Terminated(), 143, "stopped"),
        (KeyError("x"), 1, "internal error"),
    ],
)
def test_every_end_has_its_code_and_one_sentence(capsys, error, code, words):
    assert exit_code(raising(error)) == code
    out, errors = capsys.readouterr()
    assert out == "" and errors.count("\n") == 1
    assert errors.startswith("touchatlas: ") and words in errors


@pytest.mark.parametrize("code", [None, 0, 1, 130])
def test_a_commands_own_code_is_kept(code):
    assert exit_code(lambda: code) == (code or 0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("max-length is -1; give more", "--max-length is -1; give more"),
        ("tip_radius is -1", "--tip-radius is -1"),
        ("noise is -1", "noise is -1"),
        ("part.stl is empty", "part.stl is empty"),
    ],
)
def test_an_error_begins_with_the_flag_of_what_was_given(words, said):
    with (
        pytest.raises(ValueError) as refusal,
        named_by_flags(["noise", "--max-length=-1", "--tip-radius"]),
    ):
        raise ValueError(words)
    assert str(refusal.value) == said


def test_what_is_noted_to_a_mistake_is_said(capsys):
    error = ValueError("nothing tells the side")
    error.add_note("--outside says it")
    assert exit_code(raising(error)) == 2
    assert capsys.readouterr().err == "touchatlas: nothing tells the side; --outside says it\n"
