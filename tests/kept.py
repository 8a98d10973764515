"""Explorations that tests share, made once by whichever process asks for them first."""

import os
import pickle
from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path

_folder: list[Path] = []


def keep_in(folder: Path) -> None:
    """Name the folder that all processes of this run of the tests share."""
    _folder[:] = [folder]


def kept_once(make: Callable) -> Callable:
    """Every call returns a copy of what ``make`` made of its arguments, which are its name.

    A copy is read from bytes, in the process that made it as in others: all of them are alike. Two
    processes that ask at the same time both make it.
    """

    @lru_cache
    def made(*arguments) -> bytes:
        words = "-".join(map(str, (make.__module__, make.__name__, *arguments)))
        path = _folder[0] / f"{words}.pickle"
        if not path.exists():
            part = path.with_name(f"{path.name}.{os.getpid()}")
            part.write_bytes(pickle.dumps(make(*arguments), pickle.HIGHEST_PROTOCOL))
            part.rename(path)
        return path.read_bytes()

    @wraps(make)
    def copied(*arguments):
        return pickle.loads(made(*arguments))

    return copied
