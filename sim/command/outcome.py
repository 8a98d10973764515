"""How a command ends: its exit code, and one sentence where something is wrong."""

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum

from cyclopts import CycloptsError, UnknownCommandError, UnknownOptionError, UnusedCliTokensError

from touchatlas.sim.run.interrupt import Terminated


class ExitCode(IntEnum):
    """How a command ended, for the shell; signals count from 128."""

    FAILURE = 1
    USER = 2
    INTERRUPTED = 130
    TERMINATED = 143


_ADVICE = {
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), "see who may read and write there"),
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), "see that there is space"),
}


def exit_code(command: Callable[[], int | None]) -> int:
    """Run a command: 2 for the user's mistakes, 1 for failures, never a traceback."""
    try:
        code = command() or 0
        # None when standard output was closed before the command began.
        if sys.stdout is not None:
            sys.stdout.flush()
    except CycloptsError as error:
        command_line = " ".join(("touchatlas", *(error.command_chain or ())))
        code = complain(
            f"{_misused(error, command_line)}; see {command_line} --help", ExitCode.USER
        )
    except ValueError as error:
        words = "; ".join([str(error), *getattr(error, "__notes__", [])])
        code = complain(words, ExitCode.USER)
    except BrokenPipeError:
        # The reader has closed the pipe: the rest of the buffer must go nowhere, or Python would
        # raise again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = ExitCode.FAILURE
    except OSError as error:
        code = complain(_trouble(error), ExitCode.FAILURE)
    except MemoryError:
        code = complain("out of memory; try a smaller mesh or a larger tolerance", ExitCode.FAILURE)
    except KeyboardInterrupt as stop:
        code = ExitCode.TERMINATED if isinstance(stop, Terminated) else ExitCode.INTERRUPTED
        complain("; ".join(["stopped", *getattr(stop, "__notes__", [])]), code)
    except Exception as error:
        words = "; ".join([repr(error), *getattr(error, "__notes__", [])])
        code = complain(f"internal error, please report it: {words}", ExitCode.FAILURE)
    return code


@contextmanager
def named_by_flags(line: Iterable[str]) -> Iterator[None]:
    """Let an error that begins with the name of an argument, as "max-length is -1", begin with its
    flag, where this is among the words of the command line."""
    try:
        yield
    except ValueError as error:
        name, verb, rest = str(error).partition(" is ")
        flag = f"--{name.replace('_', '-')}"
        if type(error) is ValueError and verb and flag in {word.partition("=")[0] for word in line}:
            error.args = (f"{flag} is {rest}",)
        raise


def say(sentence: str) -> None:
    """Print one line on standard error, if it can be written."""
    if sys.stderr is not None:
        with suppress(OSError):
            # In one piece: the thread that shows progress writes as well.
            sys.stderr.write(f"touchatlas: {' '.join(sentence.split())}\n")


def complain(sentence: str, code: int) -> int:
    """Say what is wrong, and return the code."""
    say(sentence)
    return code


def _misused(error: CycloptsError, command_line: str) -> str:
    """What is wrong with a command line."""
    if isinstance(error, UnusedCliTokensError):
        rest = " ".join(error.unused_tokens or ())
        return (
            f"{command_line} takes fewer arguments: leave out {rest}, or quote a name with spaces"
        )
    if isinstance(error, UnknownCommandError) and error.unused_tokens and error.app is not None:
        commands = [name for name in error.app if not name.startswith("-")]
        return f'Unknown command "{error.unused_tokens[0]}": there are {", ".join(commands)}'
    if isinstance(error, UnknownOptionError) and (error.command_chain or ())[-1:] == ("resume",):
        return _not_resumed(error)
    return str(error).rstrip(" ,.")


def _not_resumed(error: UnknownOptionError) -> str:
    """What to do where resume was given a setting that only explore takes."""
    from touchatlas.sim.folder.option_tables import flag_of, options_of
    from touchatlas.sim.folder.run_options import RunOptions

    flag = error.token.keyword
    if flag not in {flag_of(option.name) for option in options_of(RunOptions())}:
        return str(error).rstrip(" ,.")
    return (
        f"a run keeps its settings, so resume takes no {flag}; touchatlas explore OBJECT --options "
        f"RUN/run.toml {flag} VALUE --out ANOTHER explores again with others"
    )


def _trouble(error: OSError) -> str:
    if error.strerror is None:
        words = str(error)
    else:
        where = f"{error.filename}: " if error.filename is not None else ""
        advice = f"; {_ADVICE[error.errno]}" if error.errno in _ADVICE else ""
        words = where + error.strerror + advice
    return "; ".join([words, *getattr(error, "__notes__", [])])
