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
from multiprocessing import get_context
from typing import Any

import numpy as np

from touchatlas.patch.fit import fit_patch
from touchatlas.patch.patch import Patch
from touchatlas.sim.peers import Jet, fit_jet, mesh_around, mesh_curvatures
from touchatlas.sim.scenes import SURFACES, Scene, draw_scene

TILT = np.pi / 6.0
MEASURES = (
    "mean_error",
    "max_error",
    "curvature_error",
    "time_ratio",
    "within",
    "curvature_within",
)
SHARES = ("within", "curvature_within")
# Standard deviations that hold 95 % of a Gaussian.
_DEVIATIONS = 1.96
# A fit is repeated so often; one that takes longer than this, in seconds, is not.
_REPEATS, _SLOW = 5, 0.05
_BARE_SHAPE = (57, 15)
# How near to zero, in radii, a height is sought, and in how many steps.
_FOUND, _SECANT_STEPS = 1e-12, 20
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@dataclass(frozen=True)
class Cell:
    """One kind of scene.

    Parameters
    ----------
    surface : str
        One of ``touchatlas.sim.scenes.SURFACES``.
    noise_std : float, length
    tilted : bool
        The sampling planes lean from the normal by up to 30 degrees.
    """

    surface: str
    noise_std: float
    tilted: bool


CELLS = tuple(Cell(*parts) for parts in product(SURFACES, (0.0, 0.02, 0.05), (False, True)))


@dataclass(frozen=True)
class Method:
    """One way from touches to a surface.

    Parameters
    ----------
    fit : callable
        What is timed.
    judge : callable
        (answer, scene) to the measures by name.
    prepare : callable
        (scene, generator) to the argument of ``fit``.
    count : int
        Fits that one call makes.
    """

    fit: Callable[[Any], Any]
    judge: Callable[[Any, Scene], dict[str, float]]
    prepare: Callable[[Scene, np.random.Generator], Any] = lambda scene, rng: scene
    count: int = 1


def height_error(patch: Patch, points) -> np.ndarray:
    """(n,) heights of world points over a patch along its normal, length.

    The height z(x, y) is where the signed distance along the normal through each point vanishes,
    found by secants; infinite where they do not meet the patch.
    """
    before, height = np.zeros(len(points)), -patch.signed_distance(points)
    value = -height
    for _ in range(_SECANT_STEPS):
        ahead = patch.signed_distance(points + height[:, None] * patch.frame.normal)
        slope = ahead - value
        # Where it is found already, what is left of the slope is rounding.
        going = (np.abs(ahead) > _FOUND * patch.radius) & (slope != 0.0)
        step = (height - before) / np.where(going, slope, 1.0)
        before, value = height, ahead
        height = np.where(going, height - ahead * step, height)
    return np.where(np.abs(value) <= 1e3 * _FOUND * patch.radius, -height, np.inf)


def judge_patch(patch: Patch, scene: Scene) -> dict[str, float]:
    """All measures of a patch but its time."""
    exact, known = np.array([scene.k1, scene.k2]), patch.curvatures
    error = np.array([known.k1, known.k2]) - exact
    distance = np.abs(patch.signed_distance(scene.verifying))
    return {
        **_height_measures(height_error(patch, scene.verifying)),
        **_curvature_measure(error, scene),
        "within": float(np.mean(distance <= _DEVIATIONS * patch.deviation(scene.verifying))),
        "curvature_within": float(np.mean(np.abs(error) <= _DEVIATIONS * known.std)),
    }


def _judge_jet(jet: Jet, scene: Scene) -> dict[str, float]:
    error = np.array([jet.k1 - scene.k1, jet.k2 - scene.k2])
    heights = jet.height_error(scene.verifying)
    return {**_height_measures(heights), **_curvature_measure(error, scene)}


def _judge_mesh(curvatures, scene: Scene) -> dict[str, float]:
    return _curvature_measure(curvatures[0] - np.array([scene.k1, scene.k2]), scene)


def _height_measures(error) -> dict[str, float]:
    size = np.abs(error)
    return {"mean_error": float(size.mean()), "max_error": float(size.max())}


def _curvature_measure(error, scene: Scene) -> dict[str, float]:
    size = max(abs(scene.k1), abs(scene.k2), 1.0 / scene.reach)
    return {"curvature_error": float(np.sqrt(np.mean(error**2)) / size)}


def _map(scene: Scene) -> Patch:
    return fit_patch(scene.contact, scene.contours, scene.normal).patch


def _jet(degree: int) -> Method:
    def fit(scene: Scene) -> Jet:
        samples = np.concatenate([contour.points for contour in scene.contours])
        return fit_jet(scene.contact, samples, scene.normal, degree)

    return Method(fit, _judge_jet)


METHODS = {
    "map": Method(_map, judge_patch),
    "jet_2": _jet(2),
    "jet_4": _jet(4),
    # One call fits a quadric at each vertex of the mesh; its time is that of one of them.
    "igl_mesh": Method(lambda mesh: mesh_curvatures(*mesh), _judge_mesh, mesh_around, 271),
}


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
        shares within 1.96 standard deviations, means. NaN where a method has no answer.

    Notes
    -----
    Each process runs its linear algebra in one thread, and times the bare solve beside each fit.
    """
    for name, value, least in (("draws", draws, 1), ("seed", seed, 0)):
        if value < least:
            raise ValueError(f"{name} is {value}; it must be >= {least}")
    found: dict[Cell, list[dict]] = {}
    with _workers(len(cells)) as pool:
        waiting = {pool.submit(measure_cell, cell, draws, seed): cell for cell in cells}
        for future in as_completed(waiting):
            found[waiting[future]] = future.result()
            watch(len(found), len(cells))
    return [row for cell in cells for row in found[cell]]


@contextmanager
def _workers(most: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes with one thread each; an interrupt leaves what they have not begun."""
    before = {name: os.environ.get(name) for name in _THREADS}
    # Read when numpy is loaded, so before the processes begin.
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    count = max(1, min(os.cpu_count() or 1, most))
    pool = ProcessPoolExecutor(count, get_context("spawn"), _ignore_interrupts)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _ignore_interrupts() -> None:
    """Ctrl-C reaches every process of a terminal; the first one sees to the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


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
    """A call's answer, and its median time in seconds over some repeats after it; a slow call's
    own time."""
    times: list[float] = []
    answer = None
    for _ in range(1 + _REPEATS):
        start = time.perf_counter()
        answer = call(argument)
        times.append(time.perf_counter() - start)
        if times[0] > _SLOW:
            return answer, times[0]
    return answer, float(np.median(times[1:]))


def middle(rows: list[dict]) -> dict[str, float]:
    """Medians of the measures over rows, means of those that are shares; NaN where missing."""
    values = {name: [row.get(name, np.nan) for row in rows] for name in MEASURES}
    return {
        name: float(np.mean(found) if name in SHARES else np.median(found))
        for name, found in values.items()
    }


def overall(rows: list[dict]) -> list[dict]:
    """One row a method: its rows in all cells, summed up by ``middle``."""
    names = dict.fromkeys(row["method"] for row in rows)
    return [
        {"method": name, **middle([row for row in rows if row["method"] == name])} for name in names
    ]
