"""Cells: the pieces of work of a study, and the file that keeps what became of each."""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import IO, Any

from touchatlas.atlas.files import write_whole

Row = dict[str, str]
LEDGER = "cells.jsonl"


@dataclass(frozen=True)
class Cell:
    """One piece of work of a study.

    Parameters
    ----------
    file : str
        Name of the table that its rows are in.
    head : dict of str
        Columns of the row that stands for it where it has no other.
    given : tuple
        Arguments of ``Study.measure``, of which JSON can be made. All that its rows depend on is
        among them.
    """

    file: str
    head: Row
    given: tuple

    def key(self, measure: Callable) -> str:
        """What tells the cell from any other: a hash of the function and its arguments."""
        words = [measure.__module__, measure.__qualname__, self.given]
        return hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()[:24]


@dataclass(frozen=True)
class Limits:
    """What one cell may take; no limit where None.

    Parameters
    ----------
    seconds : float, s, optional
    gigabytes : float, 1e9 bytes, optional
        Of memory that is in use.
    deaths : int
        How often the process of a cell may die before it is given up.
    """

    seconds: float | None = None
    gigabytes: float | None = None
    deaths: int = 3

    def __post_init__(self) -> None:
        for name in ("seconds", "gigabytes"):
            check_limit(name, getattr(self, name))
        if self.deaths < 1:
            raise ValueError(f"deaths is {self.deaths!r}; it must be a whole number >= 1")


def check_limit(name: str, value: float | None) -> None:
    """Refuse a limit of a name that is not a number > 0, or left out."""
    if value is not None and not 0.0 < value < float("inf"):
        raise ValueError(f"{name} is {value!r}; it must be a number > 0, or left out")


# What became of a cell.
DONE, FAILED, LIMITED, LOST = "done", "failed", "limited", "lost"


@dataclass(frozen=True)
class Answer:
    """What became of a cell.

    Parameters
    ----------
    kind : str
        "done"; "failed" for an exception; "limited" where it exceeded its time or memory; "lost"
        where its process died too often.
    rows : list of dict of str
        Those of a cell that is done.
    words : str
        Why it is not done.
    seconds : float, s
        Wall time.
    gigabytes : float, 1e9 bytes
        Largest memory that its process was seen to use; 0 where nobody looked.
    where : str
        Machine on which it was measured.
    limits : dict
        The ``Limits`` it had.
    """

    kind: str
    rows: list[Row] = field(default_factory=list)
    words: str = ""
    seconds: float = 0.0
    gigabytes: float = 0.0
    where: str = ""
    limits: dict[str, Any] = field(default_factory=dict)

    def settles(self, limits: Limits) -> bool:
        """Whether the cell need not be measured again: it is done, or the limits are those that
        it exceeded."""
        return self.kind == DONE or self.kind == LIMITED and self.limits == asdict(limits)


class Ledger:
    """The answers of cells by their keys, in a file that grows by one line an answer.

    A line that was cut off when its process was killed is left out, and its cell is measured
    again. Of two lines for one cell the last one counts.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LEDGER
        self.answers: dict[str, Answer] = {}
        self._file: IO[bytes] | None = None

    def __enter__(self) -> "Ledger":
        data = self.path.read_bytes() if self.path.is_file() else b""
        whole = data[: data.rfind(b"\n") + 1]
        self.answers = _answers(whole, self.path)
        self._file = open(self.path, "r+b" if self.path.is_file() else "w+b")  # noqa: SIM115
        self._file.truncate(len(whole))
        self._file.seek(len(whole))
        return self

    def add(self, key: str, answer: Answer) -> None:
        """Keep an answer: in the file, whatever happens to this process."""
        assert self._file is not None
        self.answers[key] = answer
        self._file.write(_line(key, answer))
        self._file.flush()

    def __exit__(self, *_) -> None:
        assert self._file is not None
        os.fsync(self._file.fileno())
        self._file.close()


def kept_answers(folder: Path) -> dict[str, Answer]:
    """The answers that a folder keeps, by the keys of their cells; none where it has no ledger."""
    path = folder / LEDGER
    data = path.read_bytes() if path.is_file() else b""
    return _answers(data[: data.rfind(b"\n") + 1], path)


def keep_answers(folder: Path, answers: dict[str, Answer]) -> None:
    """Let a folder keep these answers alone."""
    lines = [_line(key, answer) for key, answer in answers.items()]
    write_whole(folder / LEDGER, b"".join(lines))


def _line(key: str, answer: Answer) -> bytes:
    """The line of an answer."""
    return json.dumps([key, asdict(answer)]).encode() + b"\n"


def _answers(data: bytes, path: Path) -> dict[str, Answer]:
    """The answers of whole lines; ValueError for a line that is none of ours."""
    found = {}
    for number, line in enumerate(data.splitlines(), start=1):
        try:
            key, answer = json.loads(line)
            found[key] = Answer(**{f.name: answer[f.name] for f in fields(Answer)})
        except (ValueError, LookupError, TypeError):
            raise ValueError(
                f"line {number} of {path} is none that a study writes; put the file back, or "
                "choose another --out"
            ) from None
    return found
