"""Every case of the families of a study, in as many processes as there are cores."""

import csv
import io
from collections.abc import Callable, Mapping
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from touchatlas.atlas.files import write_whole
from touchatlas.sim.study.paper.tables import check_options
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.methods import METHODS
from touchatlas.sim.study.stability.outcome import Verdict, verdict
from touchatlas.sim.study.tradeoff import workers

COLUMNS = (
    *("family", "severity", "draw", "method", "outcome", "error", "height_ratio"),
    *("normal_ratio", "curvature_ratio", "held", "claim", "doubts", "words"),
)


@dataclass(frozen=True)
class Job:
    """All cases of one family at one severity."""

    family: str
    severity: float
    draws: int
    seed: int


class Severities(Protocol):
    """What a sweep and its pictures ask of a family."""

    @property
    def title(self) -> str: ...
    @property
    def severities(self) -> tuple[float, ...]: ...


@dataclass(frozen=True)
class Study:
    """Families that are measured alike.

    Parameters
    ----------
    name : str
        Of the files of its summary.
    families : mapping of str
        The families by name.
    measure : callable
        Job to its rows, dicts with the COLUMNS as text.
    methods : int
        Rows of each case.
    draws : int
        Cases of each severity that a full sweep has.
    error, near : str
        What ``error`` is, and what is counted where it is three at most, for the pictures.
    """

    name: str
    families: Mapping[str, Severities]
    measure: Callable[[Job], list[dict[str, str]]]
    methods: int
    draws: int
    error: str
    near: str


def sweep(
    study: Study,
    folder: Path,
    families: tuple[str, ...] = (),
    draws: int | None = None,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict[str, str]]:
    """Measure the families, and keep each severity in the folder as soon as it is done.

    Parameters
    ----------
    study : Study
    folder : Path
        Holds ``FAMILY.csv``; severities that it has already, of as many draws and the same seed,
        are not measured again.
    families : tuple of str
        All of them when empty.
    draws : int, optional
        Cases of each severity; those of the study if not given.
    seed : int
        A case depends on it, on the family, the severity and its number alone.
    watch : callable
        Called with the number of severities done and of all.

    Returns
    -------
    list of dict
        One row a case and method, with the COLUMNS as text.
    """
    draws = study.draws if draws is None else draws
    check_options(draws, seed)
    names, found = families or tuple(study.families), study.families
    jobs = [Job(name, s, draws, seed) for name in names for s in found[name].severities]
    whole = draws * study.methods
    known = {name: _read(folder / f"{name}-{seed}.csv", whole) for name in names}
    waiting = [job for job in jobs if job.severity not in known[job.family]]
    watch(len(jobs) - len(waiting), len(jobs))
    with workers(max(1, len(waiting))) as pool:
        running = {pool.submit(study.measure, job): job for job in waiting}
        for done, future in enumerate(as_completed(running)):
            job = running[future]
            known[job.family][job.severity] = future.result()
            _write(folder / f"{job.family}-{seed}.csv", known[job.family])
            watch(len(jobs) - len(waiting) + done + 1, len(jobs))
    return [row for job in jobs for row in known[job.family][job.severity]]


def measure_severity(job: Job) -> list[dict[str, str]]:
    """The rows of one severity."""
    family, rows = FAMILIES[job.family], []
    place = family.severities.index(job.severity)
    for draw in range(job.draws):
        rng = np.random.default_rng([job.seed, *job.family.encode(), place, draw])
        case = family.draw(job.severity, rng)
        for name, method in METHODS.items():
            rows.append(_row(job, draw, name, verdict(method, case)))
    return rows


def _row(job: Job, draw: int, method: str, found: Verdict) -> dict[str, str]:
    numbers = (found.error, *found.ratios, found.held, found.claim)
    values = (
        *(job.family, repr(job.severity), str(draw), method, found.outcome.value),
        *(f"{x:.4g}" for x in numbers),
        *("; ".join(found.doubts), found.words),
    )
    return dict(zip(COLUMNS, values, strict=True))


ONE_PATCH = Study(
    *("stability", FAMILIES, measure_severity, len(METHODS), 25),
    *("median error of heights / noise", "heights within 3 noises, %"),
)


def _read(path: Path, whole: int) -> dict[float, list[dict[str, str]]]:
    """The rows of a file by severity, those that have all draws of all methods."""
    if not path.is_file():
        return {}
    found: dict[float, list[dict[str, str]]] = {}
    for row in csv.DictReader(io.StringIO(path.read_text())):
        found.setdefault(float(row["severity"]), []).append(row)
    return {s: rows for s, rows in found.items() if len(rows) == whole}


def _write(path: Path, rows: dict[float, list[dict[str, str]]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=COLUMNS)
    writer.writeheader()
    for found in rows.values():
        writer.writerows(found)
    write_whole(path, text.getvalue().encode())
