"""Accuracy against speed of one patch from three curves: our methods, the paper's, peers'.

Every method gets the same touches: three curves of 19 points at a random reference point, in
planes 60 degrees apart, with noise. It is judged on nine other curves, exact, as in the paper's
section 2.4, and on the exact principal curvatures.
"""

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from multiprocessing import active_children, get_context
from typing import Any

import numpy as np

from touchatlas.sim.study.paper.tables import check_options
from touchatlas.sim.study.scenes import SURFACES, draw_scene
from touchatlas.sim.study.tradeoff_methods import METHODS, PAPER

TILT = np.pi / 6.0
MEASURES = (
    "mean_error",
    "max_error",
    "curvature_error",
    "time_ratio",
    "within",
    "curvature_within",
)
RATIOS = {"error_to_paper": "mean_error", "time_to_paper": "time_ratio"}
FRACTIONS = ("within", "curvature_within")
# A fit is repeated so often; one that takes longer than this, in seconds, is not.
_REPEATS, _SLOW = 3, 0.02
# Processor time, which others on the machine leave as it is, where it is fine enough.
_CLOCK = (
    time.process_time
    if time.get_clock_info("process_time").resolution < 1e-5
    else time.perf_counter
)
_BARE_SHAPE = (57, 15)
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@dataclass(frozen=True)
class Cell:
    """One kind of scene.

    Parameters
    ----------
    surface : str
        One of ``touchatlas.sim.study.scenes.SURFACES``.
    noise_std : float, length
    tilted : bool
        The sampling planes lean from the normal by up to 30 degrees.
    """

    surface: str
    noise_std: float
    tilted: bool


CELLS = tuple(Cell(*parts) for parts in product(SURFACES, (0.0, 0.02, 0.05), (False, True)))


def measure(
    cells: tuple[Cell, ...] = CELLS,
    draws: int = 50,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict]:
    """Measure every method in every cell, in as many processes as there are cores.

    Parameters
    ----------
    cells : tuple of Cell
    draws : int
        Scenes a cell.
    seed : int
        A cell's scenes depend on it and on the cell alone.
    watch : callable
        Called with the number of cells done and of all, for progress.

    Returns
    -------
    list of dict
        One a method and cell: ``method``, ``surface``, ``noise``, ``planes``, ``draws`` and the
        ``MEASURES``: errors in length (curvatures: relative to the largest, or to 1/reach where
        that is more) and times in bare least-squares solves of 57 x 15, medians over the draws;
        fractions within 1.96 standard deviations, means. NaN where a method has no answer.

    Notes
    -----
    Each process runs its linear algebra in one thread, and times the bare solve beside each fit.
    """
    check_options(draws, seed)
    found: dict[Cell, list[dict]] = {}
    with workers(len(cells)) as pool:
        waiting = {pool.submit(measure_cell, cell, draws, seed): cell for cell in cells}
        for future in as_completed(waiting):
            found[waiting[future]] = future.result()
            watch(len(found), len(cells))
    return [row for cell in cells for row in found[cell]]


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


def measure_cell(cell: Cell, draws: int, seed: int) -> list[dict]:
    """The rows of one cell, see ``measure``."""
    rng = np.random.default_rng([seed, *repr(cell).encode()])
    problem = rng.normal(size=_BARE_SHAPE), rng.normal(size=_BARE_SHAPE[0])
    scores: dict[str, list[dict]] = {name: [] for name in METHODS}
    for scene_rng, peer_rng in (rng.spawn(2) for _ in range(draws)):
        tilt = TILT if cell.tilted else 0.0
        scene = draw_scene(cell.surface, cell.noise_std, tilt, scene_rng)
        _, bare = timed(_bare, problem)
        for name, method in METHODS.items():
            answer, seconds = timed(method.fit, method.prepare(scene, peer_rng))
            score = method.judge(answer, scene)
            scores[name].append(score | {"time_ratio": seconds / method.count / bare})
    planes = "tilted" if cell.tilted else "normal"
    head = {"surface": cell.surface, "noise": cell.noise_std, "planes": planes, "draws": draws}
    return [{"method": name, **head, **middle(scores[name])} for name in METHODS]


def _bare(problem):
    """The unit of time."""
    return np.linalg.lstsq(problem[0], problem[1], rcond=None)


def timed(call: Callable[[Any], Any], argument) -> tuple[Any, float]:
    """A call's answer, and the median time in seconds of some repeats after it; of a slow call,
    its own time."""
    times: list[float] = []
    answer = None
    for _ in range(1 + _REPEATS):
        start = _CLOCK()
        answer = call(argument)
        times.append(_CLOCK() - start)
        if times[0] > _SLOW:
            return answer, times[0]
    return answer, float(np.median(times[1:]))


def middle(rows: list[dict]) -> dict[str, float]:
    """Medians of the measures over rows, means of those that are fractions; NaN where missing."""
    values = {name: [row.get(name, np.nan) for row in rows] for name in MEASURES}
    return {
        name: float(np.mean(found) if name in FRACTIONS else np.median(found))
        for name, found in values.items()
    }


def overall(rows: list[dict]) -> list[dict]:
    """One row a method: its rows in all cells summed up by ``middle``, and medians of its
    ``error_to_paper`` and ``time_to_paper``, over the paper's (5) by descent in the same cell."""
    paper = {_kind(row): row for row in rows if row["method"] == PAPER}
    summed = []
    for name in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == name]
        ratios = {
            ratio: float(np.median([row[of] / paper[_kind(row)][of] for row in own]))
            for ratio, of in RATIOS.items()
        }
        summed.append({"method": name, **middle(own), **ratios})
    return summed


def _kind(row: dict) -> tuple:
    return row["surface"], row["noise"], row["planes"]
