"""One exploration, touched and judged without a folder: the cell of studies of whole surfaces."""

import math
import time
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas import Atlas, Surface, Touch, doubts, extract_surface
from touchatlas.atlas.check.faults import faults
from touchatlas.planner import Planner, explore
from touchatlas.sim.folder.option_tables import updated
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.judge.truth import EvaluateOptions
from touchatlas.sim.machine.simulated_probe import probe_of
from touchatlas.sim.run.conclusion import truth_of
from touchatlas.sim.run.exploration import completed
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.oracle import errors
from touchatlas.sim.world.objects import file_digest, make_object

# What a run took and came to; those of evaluation.json have its meanings, in the object's unit. No
# flag has one of these names, which is a column where it varies.
FIGURES = (
    *("touches", "points", "tracked_length", "travel_length", "machine_seconds", "touches_to_99"),
    *("machine_seconds_to_99", "predicted_coverage", "coverage", "accuracy_p95", "accuracy_max"),
    *("completeness_p95", "completeness_max", "deviation_calibration", "watertight"),
    *("euler_characteristic", "faces", "patches", "tolerance_used", "diagonal", "met", "ended"),
    *("free_disc", "doubts", "touches_to_fault"),
)
# What depends on the machine that computes.
TIMED = ("seconds", "wall_seconds")


@dataclass(frozen=True)
class MachineTime:
    """How long a machine takes for a touch, on bodies of any size, where the probe has no clock.

    A scanner that follows a body of 100 mm with 10 mm/s, as ``TrackingOptions`` say, and travels
    ten times as fast.

    Parameters
    ----------
    scan, travel : float, diagonals/s
    touch : float, s
        Of each touch besides, to approach and to settle.
    """

    scan: float = 0.1
    travel: float = 1.0
    touch: float = 2.0

    def seconds(self, touch: Touch, diagonal: float) -> float:
        """Of one touch, with its way."""
        lengths = touch.tracked_length / self.scan + touch.travel_length / self.travel
        return self.touch + lengths / diagonal


@dataclass(frozen=True, eq=False)
class Course:
    """An exploration that has ended.

    Parameters
    ----------
    atlas : Atlas
        Finished.
    planner : Planner
    touches : list of Touch
    surface : Surface or None
    predicted : float
        Share of the surface that is expected within the tolerance.
    shares : list of float
        After each touch: the share of true points within the tolerance.
    clock : list of float, s
        After each touch: what the machine of the probe has taken; None of a probe without one.
    to_fault : int or None
        Touches after which a fault of the probe was first named.
    seconds, wall : float, s
        Processor and wall time of planning, learning and drawing.
    ended : str
    """

    atlas: Atlas
    planner: Planner
    touches: list[Touch]
    surface: Surface | None
    predicted: float
    shares: list[float]
    clock: list[float | None]
    to_fault: int | None
    seconds: float
    wall: float
    ended: str

    def reached(self, share: float) -> int | None:
        """Touches after which such a share of the truth was first within the tolerance."""
        return next((k for k, known in enumerate(self.shares, start=1) if known >= share), None)


class Stopwatch:
    """Processor and wall seconds of what is done within it."""

    def __init__(self) -> None:
        self.seconds = self.wall = 0.0

    def __enter__(self) -> None:
        self._begun = time.process_time(), time.perf_counter()

    def __exit__(self, *_) -> None:
        self.seconds += time.process_time() - self._begun[0]
        self.wall += time.perf_counter() - self._begun[1]


def explored(obj, options: RunOptions, points=None) -> Course:
    """Explore an object, with the same touches as a run of these options, which are complete.

    Parameters
    ----------
    obj : ImplicitObject or MeshObject
    options : RunOptions
    points : (n, 3) float, length, optional
        True points, at which the surface is compared with the truth after each touch.
    """
    probe_rng, _, _, planner_rng = random_streams(options.seed)
    atlas, planner = begin(options, obj, planner_rng)
    probe, watch, away = probe_of(options, obj, probe_rng), Stopwatch(), Stopwatch()
    touches, shares, clock, to_fault = [], [], list[float | None](), None

    def touch(plan) -> Touch:
        with away:
            return probe(plan)

    steps = explore(atlas, planner, touch, options.max_touches, options.max_length)
    while True:
        with watch:
            step = next(steps, None)
        if step is None:
            break
        touches.append(step.touch)
        clock.append(getattr(probe, "seconds", None))
        if to_fault is None and faults(atlas):
            to_fault = len(touches)
        if points is not None:
            shares.append(float(np.mean(errors(atlas, points) <= atlas.tolerance)))
    predicted = planner.forecast(atlas).predicted_coverage
    with watch:
        atlas.finish()
        surface = extract_surface(atlas) if len(atlas) else None
    return Course(
        *(atlas, planner, touches, surface, predicted, shares, clock, to_fault),
        *(watch.seconds - away.seconds, watch.wall - away.wall),
        planner.stop.reason.value if planner.stop else "budget",
    )


def options_of_run(table: dict, fractions: dict[str, float], seed: int, obj) -> RunOptions:
    """The complete options of a run: a table of options, and lengths that are fractions of the
    object's diagonal."""
    lengths = {name: fraction * obj.diagonal for name, fraction in fractions.items()}
    options = updated(RunOptions(), table | lengths | {"seed": seed}, "the study")
    return completed(options, obj)


def measure_run(
    source: str, digest: str, table: dict, fractions: dict[str, float], seed: int
) -> list[Row]:
    """The row of one exploration: ``FIGURES`` and ``TIMED``.

    Parameters
    ----------
    source : str
        A name, or the path of a mesh whose bytes have the ``digest``.
    table, fractions : dict
        See ``options_of_run``.
    seed : int
        Of the run, and of objects that are random.
    """
    if digest and file_digest(source) != digest:
        raise ValueError(f"{source} holds other bytes than when the study was begun")
    obj = make_object(source, seed)
    options = options_of_run(table, fractions, seed, obj)
    _, judge_rng, truth_rng, _ = random_streams(seed)
    course = explored(obj, options, obj.sample(2000, truth_rng)[0])
    return [row_of(course, obj, judge_rng)]


def row_of(course: Course, obj, rng, machine: MachineTime = MachineTime()) -> Row:
    """A course as a row; blank where a figure is not known."""
    tolerance, touches, surface = course.atlas.tolerance, course.touches, course.surface
    machine_seconds = np.cumsum([0.0, *(machine.seconds(t, obj.diagonal) for t in touches)])
    if None not in course.clock:
        machine_seconds = np.array([0.0, *course.clock])
    first, stop = course.reached(0.99), course.planner.stop
    disc = None if stop is None else stop.free_disc
    named = dict.fromkeys(doubt.name for doubt in doubts(course.atlas, surface, stopped=stop))
    found: dict = {
        "touches": len(touches),
        "points": course.atlas.point_count,
        "tracked_length": sum(touch.tracked_length for touch in touches),
        "travel_length": sum(touch.travel_length for touch in touches),
        "machine_seconds": machine_seconds[-1],
        "touches_to_99": first,
        "machine_seconds_to_99": None if first is None else machine_seconds[first],
        "predicted_coverage": course.predicted,
        "coverage": 0.0,
        "faces": 0 if course.atlas.body is None else len(course.atlas.body.faces),
        "patches": len(course.atlas),
        "tolerance_used": tolerance,
        "diagonal": obj.diagonal,
        "met": False,
        "ended": course.ended,
        "free_disc": None if disc is None else disc.diameter,
        "doubts": ", ".join(named),
        "touches_to_fault": course.to_fault,
        "seconds": course.seconds,
        "wall_seconds": course.wall,
    }
    if surface is not None and len(surface.faces):
        few = EvaluateOptions(8000)
        truth = truth_of(obj, tolerance, rng, few)
        mesh = surface.vertices, surface.faces
        judged = evaluate_surface(*mesh, truth, tolerance, rng, surface.deviation, few).as_dict()
        found |= {name: judged[name] for name in FIGURES if name in judged}
    return {name: cell_of(found.get(name)) for name in (*FIGURES, *TIMED)}


def cell_of(value) -> str:
    """A value as text: six digits of a number, 1 and 0 for true and false; blank for none.

    >>> cell_of(1.0 / 3.0), cell_of(True), cell_of(None), cell_of("known")
    ('0.333333', '1', '', 'known')
    """
    if value is None or isinstance(value, float) and math.isnan(value):
        return ""
    if isinstance(value, bool | np.bool_):
        return str(int(value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
