"""Every method on every case of the families, in as many processes as there are cores."""

import csv
import io
from collections.abc import Callable
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

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


def check_families(names: tuple[str, ...]) -> tuple[str, ...]:
    """The families of these names, all for none. ValueError for a name that is none."""
    for name in names:
        if name not in FAMILIES:
            raise ValueError(f"there is no family {name!r}; choose from {', '.join(FAMILIES)}")
    return names or tuple(FAMILIES)


def sweep(
    folder: Path,
    families: tuple[str, ...] = (),
    draws: int = 25,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict[str, str]]:
    """Measure the families, and keep each severity in the folder as soon as it is done.

    Parameters
    ----------
    folder : Path
        Holds ``FAMILY.csv``; severities that it has already, of as many draws and the same seed,
        are not measured again.
    families : tuple of str
        All of them when empty.
    draws : int
        Cases of each severity.
    seed : int
        A case depends on it, on the family, the severity and its number alone.
    watch : callable
        Called with the number of severities done and of all.

    Returns
    -------
    list of dict
        One row a case and method, with the COLUMNS as text.
    """
    check_options(draws, seed)
    names = check_families(families)
    jobs = [Job(name, s, draws, seed) for name in names for s in FAMILIES[name].severities]
    known = {name: _read(folder / f"{name}-{seed}.csv", draws) for name in names}
    waiting = [job for job in jobs if job.severity not in known[job.family]]
    watch(len(jobs) - len(waiting), len(jobs))
    with workers(max(1, len(waiting))) as pool:
        running = {pool.submit(measure_severity, job): job for job in waiting}
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


def _read(path: Path, draws: int) -> dict[float, list[dict[str, str]]]:
    """The rows of a file by severity, those that have all draws of all methods."""
    if not path.is_file():
        return {}
    found: dict[float, list[dict[str, str]]] = {}
    for row in csv.DictReader(io.StringIO(path.read_text())):
        found.setdefault(float(row["severity"]), []).append(row)
    return {s: rows for s, rows in found.items() if len(rows) == draws * len(METHODS)}


def _write(path: Path, rows: dict[float, list[dict[str, str]]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=COLUMNS)
    writer.writeheader()
    for found in rows.values():
        writer.writerows(found)
    write_whole(path, text.getvalue().encode())
