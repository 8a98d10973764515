"""One mechanism for all studies: jobs in processes, rows kept in tables, summaries, pictures."""

import csv
import io
import math
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

import numpy as np

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import make_out_folder

Row = dict[str, str]
Summed = list[dict[str, Any]]
Watch = Callable[[int, int], None]
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@dataclass(frozen=True)
class Job:
    """One piece of work of a study.

    Parameters
    ----------
    file : str
        Name of the table that keeps its rows.
    head : dict of str
        Columns that its first row has in common with no other job.
    given : tuple
        Arguments of ``Study.measure``; other processes get them.
    rows : int
        How many rows a finished job has; 0 for any number.
    """

    file: str
    head: Row
    given: tuple
    rows: int = 0


@dataclass(frozen=True, eq=False)
class Study:
    """What is measured, and how its rows are summed up, drawn and written.

    Parameters
    ----------
    name : str
        Of its files.
    columns, key : tuple of str
        Columns of its tables, and those that tell jobs of one table apart.
    jobs : callable
        (names, draws, seed) to its Jobs. ValueError for a name that it does not know.
    measure : callable
        ``given`` of a Job to its rows. It is called in another process.
    summary : callable
        Rows to rows of numbers.
    pictures : callable
        Rows and their summary to a figure for each name of a file.
    table : callable
        Rows and their summary to what a terminal shows.
    draws : int
        Draws of a full study.
    failed : dict of str
        Columns of the row of a job that raised an exception.
    note : str
        The column for the words of that exception.
    follows : tuple of str
        Methods whose rows follow the first row of their job.
    keeps_summary : bool
        Whether ``NAME.csv`` is a table of the summary.
    suffixes : tuple of str
        Kinds of files of each picture.
    words : tuple of two str
        What the study does, and what it counts, for its user.
    """

    name: str
    columns: tuple[str, ...]
    key: tuple[str, ...]
    jobs: Callable[[tuple[str, ...], int, int], list[Job]]
    measure: Callable[..., list[Row]]
    summary: Callable[[list[Row]], Summed]
    pictures: Callable[[list[Row], Summed], dict[str, Any]]
    table: Callable[[list[Row], Summed], Any]
    draws: int
    note: str
    failed: Row = field(default_factory=dict)
    follows: tuple[str, ...] = ()
    keeps_summary: bool = False
    suffixes: tuple[str, ...] = ("png", "svg")
    words: tuple[str, str] = ("measuring", "jobs")


def check_options(draws: int, seed: int) -> None:
    """ValueError where there is nothing to draw."""
    for name, value, least in (("draws", draws, 1), ("seed", seed, 0)):
        if value < least:
            raise ValueError(f"{name} is {value}; it must be >= {least}")


def chart(
    study: Study,
    folder: Path,
    names: tuple[str, ...] = (),
    draws: int | None = None,
    seed: int = 0,
    watch: Watch = lambda done, total: None,
) -> tuple[list[Row], Summed]:
    """Measure what a study has of some names, and write its tables and pictures to a folder.

    Returns the rows and their summary. A chart that was interrupted goes on where it was.
    """
    draws = study.draws if draws is None else draws
    check_options(draws, seed)
    jobs = study.jobs(names, draws, seed)
    make_out_folder(folder)
    rows = run(study, jobs, folder, watch)
    summed = study.summary(rows)
    for name, figure in study.pictures(rows, summed).items():
        for suffix in study.suffixes:
            write_whole(folder / f"{name}.{suffix}", image_bytes(figure, suffix))
    if study.keeps_summary:
        text = [
            {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in r.items()} for r in summed
        ]
        write_whole(folder / f"{study.name}.csv", csv_bytes(tuple(summed[0]), text))
    return rows, summed


def run(study: Study, jobs: list[Job], folder: Path, watch: Watch) -> list[Row]:
    """The rows of the jobs, in their order; each job is kept in its table as soon as it is done.

    Jobs that a table of the folder has already are not done again. A job that raises an exception
    has one row, which says so; where its rows are counted, it is tried again the next time.
    ``watch`` is called with the number of jobs done and of all.
    """
    tables = {job.file: _read(study, folder / job.file) for job in jobs}
    waiting = [job for job in jobs if not _finished(study, job, tables[job.file])]
    watch(len(jobs) - len(waiting), len(jobs))
    with workers(max(1, len(waiting))) as pool:
        running = {pool.submit(_measured, study.measure, job.given): job for job in waiting}
        for left, future in enumerate(as_completed(running), 1 - len(waiting)):
            job, found = running[future], future.result()
            rows = _failed(study, job, found) if isinstance(found, str) else found
            tables[job.file][_key(study, job.head)] = rows
            _write(study, folder / job.file, tables[job.file], jobs)
            watch(len(jobs) + left, len(jobs))
    return [row for job in jobs for row in tables[job.file][_key(study, job.head)]]


@contextmanager
def workers(most: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes with one thread each; what stops the block ends them at once."""
    before = {name: os.environ.get(name) for name in _THREADS}
    # Read when numpy is loaded, so before the processes begin.
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    count = max(1, min(os.cpu_count() or 1, most))
    others = active_children()
    pool = ProcessPoolExecutor(count, get_context("spawn"), _end_at_interrupts)
    try:
        yield pool
    except BaseException:
        # A signal to this process alone does not reach them, and their work takes minutes.
        for process in active_children():
            if process not in others:
                process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _end_at_interrupts() -> None:
    """Ctrl-C reaches every process of a terminal; only the first one prints a sentence."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _measured(measure: Callable[..., list[Row]], given: tuple) -> list[Row] | str:
    """The rows of a job, or the words of its exception."""
    try:
        return measure(*given)
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def _failed(study: Study, job: Job, words: str) -> list[Row]:
    """The row of a job that raised an exception."""
    blank = {name: "failed" if name == "method" else "" for name in study.columns}
    return [blank | study.failed | job.head | {study.note: words}]


def _key(study: Study, row: Row) -> tuple[str, ...]:
    return tuple(row.get(name) or "" for name in study.key)


def _finished(study: Study, job: Job, table: dict) -> bool:
    """Whether a table has all rows of a job."""
    rows = table.get(_key(study, job.head), [])
    whole = len(rows) == job.rows if job.rows else bool(rows)
    return whole and job.head.items() <= rows[0].items()


def _read(study: Study, path: Path) -> dict[tuple[str, ...], list[Row]]:
    """The rows of a table by job."""
    found: dict[tuple[str, ...], list[Row]] = {}
    key: tuple[str, ...] = ()
    for row in csv.DictReader(io.StringIO(path.read_text())) if path.is_file() else ():
        if row.get("method") not in study.follows:
            key = _key(study, row)
        found.setdefault(key, []).append({name: row.get(name) or "" for name in study.columns})
    return found


def _write(study: Study, path: Path, table: dict, jobs: list[Job]) -> None:
    """Write a table: jobs of now in their order, then others that it had."""
    ordered = dict.fromkeys(_key(study, job.head) for job in jobs if job.file == path.name)
    rows = [row for key in ordered | table if key in table for row in table[key]]
    write_whole(path, csv_bytes(study.columns, rows))


def csv_bytes(columns: tuple[str, ...], rows: Iterable[dict]) -> bytes:
    """Rows as a table; blank where a column is missing."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=columns)
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def number(text: str) -> float:
    """The number of a cell; NaN where it is blank."""
    return float(text) if text else math.nan


def middle(values: Iterable[float]) -> float:
    """Median of the values that are finite; NaN where there is none."""
    known = [value for value in values if math.isfinite(value)]
    return float(np.median(known)) if known else math.nan


def grouped(rows: list[Row], *columns: str) -> dict[tuple[str, ...], list[Row]]:
    """Rows by their values of some columns, in the order in which they come.

    >>> grouped([{"a": "1"}, {"a": "2"}, {"a": "1"}], "a")[("1",)]
    [{'a': '1'}, {'a': '1'}]
    """
    found: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in columns), []).append(row)
    return found


def canvas(width: float, height: float):
    """An empty figure, inches. It is not made by pyplot, whose back end is the caller's choice."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def image_bytes(figure, suffix: str = "png") -> bytes:
    """A figure as PNG or SVG; equal figures give equal bytes."""
    import matplotlib

    image, metadata = io.BytesIO(), {"Software": None} if suffix == "png" else {"Date": None}
    with matplotlib.rc_context({"svg.hashsalt": "touchatlas"}):
        figure.savefig(image, format=suffix, dpi=100, metadata=metadata)
    return image.getvalue()
