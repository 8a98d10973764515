"""What a tolerance takes: the error of whole surfaces against touches, lengths and time.

Every object is explored to every tolerance by every planner, by one that knows the truth, and made
by others from the touches of ours.
"""

import math
from dataclasses import replace

import numpy as np

from touchatlas.patch.entry_points import PLANNERS, added
from touchatlas.planner import PlannerOptions
from touchatlas.planner.options import NAMES
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.work import random_streams
from touchatlas.sim.study.cells import Cell, Row
from touchatlas.sim.study.course import Course, explored
from touchatlas.sim.study.economy_costs import OTHERS, OURS, summary, table
from touchatlas.sim.study.economy_pictures import pictures
from touchatlas.sim.study.study import Chart, Study
from touchatlas.sim.study.surface_judge import OPTIONS, judged
from touchatlas.sim.study.surface_peers import PEERS, best_surface, samples_of
from touchatlas.sim.world.objects import make_object

COLUMNS = (
    *("object", "tolerance", "method", "seed", "touches", "tracked", "travel", "seconds"),
    *("mean_error", "p95_error", "known_share", "met", "ended"),
    *("touches_to_99", "length_to_99"),
)
KEY = COLUMNS[:4]


def measure_run(name: str, tolerance: float, method: str, seed: int) -> list[Row]:
    """The row of one exploration, and those of others on our planner's touches.

    Lengths are in diagonals of the object, of which the tolerance is a fraction.
    """
    obj = make_object(name, seed)
    options = RunOptions(
        *(obj.noise_std, tolerance * obj.diagonal, OPTIONS.most),
        seed=seed,
        planner=PlannerOptions(method),
    )
    truth = obj.sample(OPTIONS.points, random_streams(seed)[1])[0]
    course = explored(obj, options, truth)
    atlas, surface = course.atlas, course.surface
    mesh = None if surface is None else (surface.vertices, surface.faces)
    head = {"object": name, "tolerance": repr(tolerance), "method": method, "seed": str(seed)}
    rows = [head | _cells(course, judged(mesh, obj, truth, atlas.tolerance), obj.diagonal)]
    if method != OURS or not len(atlas):
        return rows
    samples, alone = samples_of(atlas, course.touches), replace(course, shares=[])
    for other in [one for one in OTHERS if PEERS[one].present()]:
        found = best_surface(PEERS[other], *samples, obj.noise_std, OPTIONS.cells, truth)
        if found is not None:
            theirs = replace(alone, seconds=course.seconds + found[2])
            judgement = judged(found[0], obj, truth, atlas.tolerance)
            rows.append(head | {"method": other} | _cells(theirs, judgement, obj.diagonal))
    return rows


def _cells(course: Course, judgement: dict[str, float], unit: float) -> Row:
    """Columns of a course and its judgement; lengths over a unit; blank where unknown."""
    tracked = [touch.tracked_length / unit for touch in course.touches]
    travel = [touch.travel_length / unit for touch in course.touches]
    first = course.reached(OPTIONS.share)
    numbers = {
        "tracked": float(sum(tracked)),
        "travel": float(sum(travel)),
        "seconds": course.seconds,
        "mean_error": judgement["mean_error"] / unit,
        "p95_error": judgement["p95_error"] / unit,
        "known_share": judgement["known_share"],
        "touches_to_99": np.nan if first is None else float(first),
        "length_to_99": np.nan if first is None else sum(tracked[:first]) + sum(travel[:first]),
    }
    words = {"met": "yes" if judgement["met"] else "no", "ended": course.ended}
    found = {name: "" if math.isnan(x) else f"{x:.5g}" for name, x in numbers.items()}
    return {"touches": str(len(course.touches))} | found | words


def cells_of(names, draws: int, seed: int, methods=None, options=OPTIONS) -> list[Cell]:
    """A run of each object, tolerance, planner and seed whose noise allows the tolerance.

    ``names`` are of built-in objects, or paths of mesh files; ``draws`` is the number of seeds.
    ValueError for what is no object.
    """
    noise, methods = {}, methods or (*NAMES, *added(PLANNERS))
    for name in names or options.objects:
        obj = make_object(name)
        noise[name] = obj.noise_std / obj.diagonal
    found = []
    for one_seed in range(seed, seed + draws):
        for tolerance in options.tolerances:
            for name, least in noise.items():
                if tolerance >= options.least_noises * least:
                    given = [(name, tolerance, method, one_seed) for method in methods]
                    found += [Cell("atlas.csv", _head(*one), one) for one in given]
    return found


def _head(name: str, tolerance: float, method: str, seed: int) -> Row:
    return dict(zip(KEY, (name, repr(tolerance), method, str(seed)), strict=True))


ECONOMY = Chart(
    Study("atlas", COLUMNS, measure_run, "ended", {"met": "no"}),
    *(cells_of, summary, pictures, table, 1),
    words=("exploring", "runs"),
)
