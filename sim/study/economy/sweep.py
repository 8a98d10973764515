"""Every object, tolerance, planner and seed, in as many processes as there are cores."""

import csv
import io
from collections.abc import Callable
from concurrent.futures import as_completed
from pathlib import Path

from touchatlas.atlas.files import write_whole
from touchatlas.sim.study.economy.trial import COLUMNS, PLANNERS, Job, measure_job
from touchatlas.sim.study.paper.tables import check_options
from touchatlas.sim.study.tradeoff import workers
from touchatlas.sim.world.objects import make_object

OBJECTS = ("ellipsoid", "blob")
# Tolerances as fractions of the diagonal.
TOLERANCES = (1e-3, 3e-3, 1e-2, 3e-4)
# A tolerance below so many standard deviations of the noise is left out. Doubled, fewer remain.
_LEAST_NOISES = 2.0

Row = dict[str, str]


def jobs_of(objects, tolerances, methods, seeds) -> list[Job]:
    """All jobs whose noise allows their tolerance; ValueError for what is no object or method."""
    for method in methods:
        if method not in PLANNERS:
            raise ValueError(f"{method!r} is no planner; choose from {', '.join(PLANNERS)}")
    noise = {}
    for name in objects:
        obj = make_object(name)
        noise[name] = obj.noise_std / obj.diagonal
    return [
        Job(name, tolerance, method, seed)
        for seed in seeds
        for tolerance in tolerances
        for name in objects
        for method in methods
        if tolerance >= _LEAST_NOISES * noise[name]
    ]


def sweep(
    path: Path,
    objects: tuple[str, ...] = OBJECTS,
    draws: int = 1,
    seed: int = 0,
    tolerances: tuple[float, ...] = TOLERANCES,
    methods: tuple[str, ...] = PLANNERS,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[Row]:
    """Explore every object to every tolerance by every method; keep each run as soon as it is done.

    Parameters
    ----------
    path : Path
        Table of the runs. Those that it has already are not made again.
    objects : tuple of str
        Built-in names, or paths of mesh files.
    draws : int
        Seeds of each, from ``seed`` on.
    seed : int
    tolerances : tuple of float
        Fractions of the diagonal; those below two deviations of an object's noise are left out.
    methods : tuple of str
        Of ``PLANNERS``.
    watch : callable
        Called with the number of runs done and of all.

    Returns
    -------
    list of dict
        Rows of these objects and seeds with the ``COLUMNS`` as text, also those that the table had
        before.
    """
    check_options(draws, seed)
    seeds = range(seed, seed + draws)
    jobs = jobs_of(objects, tolerances, methods, seeds)
    known = _read(path)
    waiting = [job for job in jobs if _key(job) not in known]
    watch(len(jobs) - len(waiting), len(jobs))
    with workers(max(1, len(waiting))) as pool:
        running = {pool.submit(measure_job, job): job for job in waiting}
        for done, future in enumerate(as_completed(running)):
            known[_key(running[future])] = future.result()
            write_whole(path, _csv([row for rows in known.values() for row in rows]))
            watch(len(jobs) - len(waiting) + done + 1, len(jobs))
    every = [row for rows in known.values() for row in rows]
    chosen = {*objects}, {str(s) for s in seeds}
    return [row for row in every if row["object"] in chosen[0] and row["seed"] in chosen[1]]


def _key(job: Job) -> tuple[str, ...]:
    return job.obj, repr(job.tolerance), job.method, str(job.seed)


def _read(path: Path) -> dict[tuple[str, ...], list[Row]]:
    """The rows of a table by run; each run's first row is its planner's, others' follow it."""
    if not path.is_file():
        return {}
    found: dict[tuple[str, ...], list[Row]] = {}
    key: tuple[str, ...] = ()
    for row in csv.DictReader(io.StringIO(path.read_text())):
        if row["method"] in PLANNERS:
            key = tuple(row[name] for name in ("object", "tolerance", "method", "seed"))
        found.setdefault(key, []).append(row)
    return found


def _csv(rows: list[Row]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
