"""One exploration by one planner to one tolerance: what it took, and how good the surface is."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import trimesh

from touchatlas.atlas import Atlas, Touch, extract_surface
from touchatlas.planner import PlannerOptions, ProbePlan, explore
from touchatlas.planner.options import NAMES
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.economy.oracle import Oracle, errors
from touchatlas.sim.study.surface_peers import (
    PEERS,
    best_surface,
    distances,
    points_and_normals,
)
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe
from touchatlas.sim.world.triangles import sample_triangles

OURS, ORACLE = "tolerance", "oracle"
PLANNERS = (*NAMES, ORACLE)
# Surfaces by others from the touches of our planner, where their package is present.
OTHERS = ("APSS", "RIMLS", "Poisson")
COLUMNS = (
    *("object", "tolerance", "method", "seed", "touches", "tracked", "travel", "seconds"),
    *("mean_error", "p95_error", "known_share", "met", "ended"),
    *("touches_to_99", "length_to_99"),
)
# Touches after which a run ends. Doubled, planners that waste touches take twice as long.
MOST = 120
# Points at which either surface is compared with the other: the standard error of a share of 0.99
# is 0.001. Four times as many halve it. The oracle knows fewer, others than the judge.
_POINTS, _ORACLE_POINTS = 8000, 2000
# Share of the truth within the tolerance at which a surface meets it, and how far off, in
# tolerances, all but one in a hundred points of the surface may be. Doubled, spikes pass.
_SHARE, _OFF = 0.99, 2.0
# The truth's triangles may be off by this fraction of the tolerance. Doubled, errors are measured
# less well by as much.
_SAGITTA = 0.02
# Cells of others' grids along the longest side. Doubled, their surfaces take eight times as long.
_CELLS = 48
_BUDGET = "budget"


@dataclass(frozen=True)
class Job:
    """One exploration: object, tolerance as a fraction of its diagonal, planner, seed."""

    obj: str
    tolerance: float
    method: str
    seed: int


@dataclass(frozen=True, eq=False)
class Course:
    """What an exploration took: touches, processor seconds without the simulated probe, and what
    was spent when 99 % of the true points were first within the tolerance, or NaN."""

    touches: list[Touch]
    seconds: float
    ended: str
    touches_to_99: float
    length_to_99: float


def measure_job(job: Job) -> list[dict[str, str]]:
    """The row of a job with the COLUMNS as text, and those of others on our planner's touches.

    Lengths are in diagonals of the object.
    """
    obj = make_object(job.obj, job.seed)
    options = RunOptions(obj.noise_std, job.tolerance * obj.diagonal, seed=job.seed)
    if job.method != ORACLE:
        options = replace(options, planner=PlannerOptions(job.method))
    probe_rng, judge_rng, truth_rng, planner_rng = random_streams(job.seed)
    atlas, planner = begin(options, obj, planner_rng)
    if job.method == ORACLE:
        planner = Oracle(*obj.start(), *obj.sample(_ORACLE_POINTS, truth_rng))
    truth = obj.sample(_POINTS, judge_rng)[0]
    course = _explored(atlas, planner, Probe(obj, obj.noise_std, probe_rng), truth)
    begun = time.process_time()
    atlas.finish()
    surface = extract_surface(atlas) if len(atlas) else None
    seconds = course.seconds + time.process_time() - begun
    mesh = None if surface is None else (surface.vertices, surface.faces)
    rows = [_row(job, job.method, obj, course, seconds, judged(mesh, obj, truth, atlas.tolerance))]
    if job.method == OURS and len(atlas):
        rows += _others(job, obj, course, atlas, truth)
    return rows


class _Timed:
    """A probe, and the processor seconds that it has taken."""

    def __init__(self, touch: Callable[[ProbePlan], Touch]) -> None:
        self._touch, self.seconds = touch, 0.0

    def __call__(self, plan: ProbePlan) -> Touch:
        begun = time.process_time()
        touch = self._touch(plan)
        self.seconds += time.process_time() - begun
        return touch


def _explored(atlas: Atlas, planner, probe: Probe, truth) -> Course:
    """Touch until the planner ends or the budget does."""
    timed = _Timed(probe)
    steps = explore(atlas, planner, timed, MOST)
    seconds, length, touches, first = 0.0, 0.0, [], (np.nan, np.nan)
    while True:
        begun = time.process_time()
        step = next(steps, None)
        seconds += time.process_time() - begun
        if step is None:
            break
        touches.append(step.touch)
        length += step.touch.tracked_length + step.touch.travel_length
        if np.isnan(first[0]) and np.mean(errors(atlas, truth) <= atlas.tolerance) >= _SHARE:
            first = float(len(touches)), length
    ended = planner.stop.reason.value if planner.stop else _BUDGET
    return Course(touches, seconds - timed.seconds, ended, *first)


def judged(
    mesh: tuple[np.ndarray, np.ndarray] | None, obj, truth, tolerance: float
) -> dict[str, float]:
    """``mean_error``, ``p95_error`` (truth to surface, length), ``known_share`` and ``met``.

    Met: 99 % of the truth within the tolerance, 99 % of the surface within twice of it,
    watertight, right Euler characteristic.

    Parameters
    ----------
    mesh : vertices (v, 3) and faces (f, 3), or None
    obj : the object
    truth : (n, 3) float, length
        Points of its surface.
    tolerance : float, length
    """
    if mesh is None or not len(mesh[1]):
        return {"mean_error": np.nan, "p95_error": np.nan, "known_share": 0.0, "met": 0.0}
    missed = distances(*mesh, truth)
    share = float(np.mean(missed <= tolerance))
    points = sample_triangles(*mesh, _POINTS, np.random.default_rng(0))[0]
    vertices, faces = obj.mesh(_SAGITTA * tolerance)
    off = np.quantile(distances(vertices, faces, points), _SHARE)
    body = trimesh.Trimesh(*mesh, process=False)
    right = not obj.closed or body.is_watertight
    right = right and body.euler_number == obj.euler_characteristic
    return {
        "mean_error": float(missed.mean()),
        "p95_error": float(np.quantile(missed, 0.95)),
        "known_share": share,
        "met": float(right and share >= _SHARE and off <= _OFF * tolerance),
    }


def _others(job: Job, obj, course: Course, atlas: Atlas, truth) -> list[dict[str, str]]:
    """The rows of others' surfaces from the same samples, with the normals of ours."""
    present = [name for name in OTHERS if PEERS[name].present()]
    if not present:
        return []
    points, kinds = points_and_normals(obj, atlas, course.touches)
    rows = []
    for name in present:
        found = best_surface(PEERS[name], points, kinds["ours"][0], obj.noise_std, _CELLS, truth)
        if found is not None:
            mesh, _, seconds = found
            judgement = judged(mesh, obj, truth, atlas.tolerance)
            unknown = replace(course, touches_to_99=np.nan, length_to_99=np.nan)
            rows.append(_row(job, name, obj, unknown, course.seconds + seconds, judgement))
    return rows


def _row(job: Job, method: str, obj, course: Course, seconds: float, judgement) -> dict[str, str]:
    """One row of text; lengths over the diagonal."""
    unit = obj.diagonal
    numbers = {
        "tracked": sum(touch.tracked_length for touch in course.touches) / unit,
        "travel": sum(touch.travel_length for touch in course.touches) / unit,
        "seconds": seconds,
        "mean_error": judgement["mean_error"] / unit,
        "p95_error": judgement["p95_error"] / unit,
        "known_share": judgement["known_share"],
        "touches_to_99": course.touches_to_99,
        "length_to_99": course.length_to_99 / unit,
    }
    words = {
        "object": job.obj,
        "tolerance": repr(job.tolerance),
        "method": method,
        "seed": str(job.seed),
        "touches": str(len(course.touches)),
        "met": "yes" if judgement["met"] else "no",
        "ended": course.ended,
    }
    row = words | {name: "" if np.isnan(x) else f"{x:.5g}" for name, x in numbers.items()}
    return {name: row[name] for name in COLUMNS}
