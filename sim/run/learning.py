"""A run that learns from files: scans and answers to plans become an atlas, its surface, and plans.

``touchatlas learn`` and ``touchatlas next`` are this, one call each.
"""

from collections.abc import Sequence
from contextlib import closing

import numpy as np

from touchatlas.atlas import Scan, Touch, TouchStatus
from touchatlas.atlas.files import write_whole
from touchatlas.planner import ProbePlan
from touchatlas.planner.loop import check_learnable
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.plan_files import plans_csv, plans_json
from touchatlas.sim.folder.run_folder import new_run, replace_run
from touchatlas.sim.folder.run_options import check_number, check_tolerance, fit_scale
from touchatlas.sim.run.learning_files import Learned, write_files
from touchatlas.sim.run.learning_run import Begun, LearningRun, LearnOptions, opened
from touchatlas.sim.run.watcher import Watcher


def begin_with_scans(
    out, scans: Sequence[Scan], options: LearnOptions, unit: str, force: bool, watcher: Watcher
) -> Learned:
    """Learn scans into a new run folder.

    Raises
    ------
    ValueError
        When a scan is refused, or the folder holds something. Nothing is written then.
    """
    points = np.concatenate([scan.points for scan in scans])
    noise = float(min(scan.noise_std.min() for scan in scans))
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    tolerance = max(1e-3 * diagonal, noise) if options.tolerance is None else options.tolerance
    check_tolerance(tolerance, diagonal)
    scale = min(fit_scale(noise, diagonal), tolerance)
    begun = Begun(options.to(tolerance), noise, scale, unit, *_side_of(scans[0]))
    # A question is put before anything is written.
    run = begun.run()
    watcher.begins("learning the points")
    refused = [run.add(scan).refused for scan in scans]
    if any(refused):
        error = ValueError("; ".join(sorted({words for words in refused if words})))
        if "outside" in str(error):
            error.add_note("--approach, --viewpoint and --outside say it on the command line")
        raise error
    with new_run(out, force) as folder:
        run.begin(folder)
        with closing(Journal(run.journal)) as journal:
            for scan in scans:
                journal.append_scan(scan)
        run.save()
        return write_files(run, watcher, []).moved(replace_run(folder))


def begin_with_start(out, start, outward, noise: float, options: LearnOptions) -> None:
    """A new run folder without any data, whose first plan is at a start point.

    Raises
    ------
    ValueError
        When the folder holds something, or there is no tolerance.
    """
    if options.tolerance is None:
        raise ValueError("there is no --tolerance; say how well the surface is wanted")
    check_number("noise", noise, or_zero=True)
    scale = 5.0 * noise or options.tolerance
    begun = Begun(options, noise, scale, "", list(map(float, start)), list(map(float, outward)))
    run = begun.run()
    with new_run(out, force=False) as folder:
        run.begin(folder)
        run.save()


def learn_more(
    path, scans: Sequence[Scan], touches: Sequence[Touch], draw: bool, watcher: Watcher
) -> Learned:
    """Learn more scans and answers to plans into a run folder.

    Raises
    ------
    ValueError
        When a touch answers no plan that is pending, or leaves one before it unanswered, or its
        unit is another; or a scan is refused. What was learned before it stays.
    """
    with opened(path) as run:
        _check_answers(run, touches)
        with closing(Journal(run.journal)) as journal:
            for scan in scans:
                watcher.begins("learning the points")
                change = run.add(scan)
                if change.refused:
                    raise ValueError(change.refused)
                journal.append_scan(scan)
            refused = _learn_answers(run, journal, touches, watcher)
        run.save()
        if not draw:
            return Learned(run.folder, {}, None, refused)
        return write_files(run, watcher, refused)


def _learn_answers(
    run: LearningRun, journal: Journal, touches: Sequence[Touch], watcher: Watcher
) -> list[str]:
    """Learn answers to pending plans one by one; why some of them taught nothing."""
    refused = []
    for place, touch in enumerate(touches):
        watcher.begins(f"learning the answer to plan {touch.number}")
        # What is in the journal must be learned, also by another call.
        try:
            check_learnable(run.atlas, run.pending[touch.number], touch)
        except ValueError as error:
            before = ", ".join(str(one.number) for one in touches[:place])
            kept = f", answers to {before} are learned: leave them out" if before else ""
            error.add_note(f"plan {touch.number} stays pending{kept}")
            raise
        journal.append(run.pending[touch.number], touch)
        if words := run.add(touch).refused:
            refused.append(f"the answer to plan {touch.number} taught nothing: {words}")
        run.save()
    return refused


def plans_of(path, count: int) -> tuple[tuple[ProbePlan, ...], str, str]:
    """The pending plans of a run, and new ones up to a count, written to plans.csv and plans.json;
    why there is none, and the unit."""
    with opened(path) as run:
        plans = run.ask(count)
        run.save()
        write_whole(run.folder / "plans.csv", plans_csv(plans))
        write_whole(run.folder / "plans.json", plans_json(plans, run.settings))
        stop = run.planner.stop
        reason = "" if plans or stop is None else stop.reason.value
        return plans, reason, run.settings.get("unit", "")


def pending_plans(path) -> dict[int, ProbePlan]:
    """The plans of a run that are not answered yet, by their numbers."""
    with opened(path) as run:
        if count := len(run.pending):
            # Plans of a file say nothing of where arms may end.
            run.planner.ask_several(run.atlas, count)
        return run.pending


def _side_of(scan: Scan) -> tuple[list[float], list[float]]:
    """A point of a scan and a direction from which it may be approached; any where the scan holds
    none."""
    outward = scan.toward[0] if scan.normals is None else scan.normals[0]
    if not outward.any():
        outward = scan.points[0] - scan.points.mean(axis=0)
    length = float(np.linalg.norm(outward))
    outward = outward / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    return scan.points[0].tolist(), outward.tolist()


def _check_answers(run: LearningRun, touches: Sequence[Touch]) -> None:
    """ValueError unless touches answer pending plans, from the first of them on, each once."""
    pending = sorted(run.pending)
    numbers = [touch.number for touch in touches]
    if numbers == pending[: len(numbers)]:
        for touch in touches:
            _check_distance(run.pending[touch.number], touch)
        return
    other = next((n for n in numbers if n not in pending), None)
    if other is not None:
        which = ", ".join(map(str, pending)) or "none"
        raise ValueError(
            f"plan {other} is not pending: {which}; give answers to plans of touchatlas next "
            f"{run.folder}"
        )
    first = next(n for n, m in zip(pending, [*numbers, -1], strict=False) if n != m)
    raise ValueError(
        f"plan {first} is not answered; give its touch as well, or say with the event "
        "unreachable that it was left out"
    )


def _check_distance(plan: ProbePlan, touch: Touch) -> None:
    """ValueError for a touch that lies twice as far from where it was planned as its plan leads, or
    farther: the contact after the approach, half of the points after the approach and an arm."""
    if touch.status is not TouchStatus.TOUCHED:
        return
    points = np.concatenate([contour.points for contour in touch.contours])
    for what, places, most in (
        ("contact", touch.contact[None], max(plan.approach, plan.usual_approach)),
        # A few bad contacts are no mistake of the caller.
        ("median point", points, plan.depth + plan.reach),
    ):
        off = places - plan.reference_point
        away = float(np.median(np.sqrt((off * off).sum(axis=1))))
        if away > 2.0 * most + touch.tip_radius:
            raise ValueError(
                f"the {what} of the answer to plan {plan.number} is {away:.4g} from its reference "
                f"point, but the plan leads no farther than {most:.4g} from it; give lengths in "
                "the unit and frame of plans.csv, or, where nothing was met so near, the event "
                "no contact"
            )
