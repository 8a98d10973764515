"""Logs of programs for LinuxCNC as touches."""

from collections.abc import Iterator

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.planner.drivers.guarded import GuardOptions, late, lateness
from touchatlas.planner.drivers.linuxcnc_files import Measure, star_of
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import Tip, TriggerOptions
from touchatlas.planner.tracking.points_touched import touch_in_vain, touch_of_centres


def touch_of_log(
    text: str,
    plan: ProbePlan,
    tip: Tip = Tip(),
    options: TriggerOptions = TriggerOptions(),
    motion: GuardOptions = GuardOptions(),
    period: float = 0.001,
) -> Touch:
    """The touch that a log of ``linuxcnc_program`` holds.

    Each place is late by 0 to feed x period: half of it is taken off along the approach, and the
    spread joins the noise.

    Parameters
    ----------
    text : str
        Of the log: nine numbers a line, of which the first three are used.
    plan, options, motion
        Those with which the program was written.
    tip : Tip
    period : float, s
        Of the servo thread.

    Returns
    -------
    Touch
        Of centres of the tip, with its radius. An arm ends at its first point that met nothing, and
        where the program was stopped.

    Raises
    ------
    ValueError
        In one sentence: a line of other than nine numbers, a log without the contact, or lines that
        are not those of this plan.
    """
    star = star_of(plan, options)
    rows = iter(_rows(text, plan))
    back = lateness(motion.feed, period)[0]
    arms: dict[tuple[int, int], list[np.ndarray]] = {}
    missed: set[tuple[int, int]] = set()
    for measure in star:
        arm = measure.plane, measure.side
        if arm in missed or (-1, 0) in missed:
            continue
        met = _measured(rows, measure, plan)
        if met is None:
            break
        if met[1]:
            arms.setdefault(arm, []).append(met[0] - back * measure.direction)
        else:
            missed.add(arm)
    if next(rows, None) is not None:
        raise ValueError(
            f"the log has more lines than plan {plan.number} has moves; give the plan and "
            "the options with which the program was written"
        )
    return _touch(plan, arms, missed, late(tip, motion.feed, period))


def _rows(text: str, plan: ProbePlan) -> list[np.ndarray]:
    """(3,) places of the lines of a log."""
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        try:
            cells = [float(cell) for cell in line.split()]
        except ValueError:
            cells = []
        if len(cells) == 9 and np.isfinite(cells).all():
            rows.append(np.array(cells[:3]))
        elif line.strip():
            raise ValueError(
                f"line {number} of the log of plan {plan.number} is {line.strip()!r}; nine numbers "
                "are needed, as PROBEOPEN writes them"
            )
    return rows


def _measured(
    rows: Iterator[np.ndarray], measure: Measure, plan: ProbePlan
) -> tuple[np.ndarray, bool] | None:
    """Where a point ended (3,), and whether by contact; None where the log ends before.

    A line is written on the way to the start, at the point, where the probe came free if there was
    contact, and back at the start. So the line after the point tells: near the start there was no
    contact.
    """
    arrived, place, after = (next(rows, None) for _ in range(3))
    if arrived is None or place is None:
        return None
    along = measure.direction
    length = float(np.linalg.norm(measure.target - measure.start))
    off = place - measure.start
    beside = float(np.linalg.norm(off - (off @ along) * along))
    # A straight way is gone to a few microsteps; a tenth of it is another plan's.
    if beside > 0.1 * length or np.linalg.norm(arrived - measure.start) > 0.1 * length:
        x, y, z = place
        raise ValueError(
            f"the log is not that of plan {plan.number}: ({x:.6g}, {y:.6g}, {z:.6g}) is beside the "
            "way of its point; give the plan and the options of the program"
        )
    if after is None:
        return None
    left = np.linalg.norm(after - place) < np.linalg.norm(after - measure.start)
    if left:
        next(rows, None)
    return place, bool(left)


def _touch(plan: ProbePlan, arms, missed, tip: Tip) -> Touch:
    """The touch of centres (3,) of the arms that met something, by plane and side."""
    if (-1, 0) in missed:
        return touch_in_vain(plan, TouchStatus.NO_CONTACT, tip)
    if (-1, 0) not in arms:
        raise ValueError(
            f"the log of plan {plan.number} ends before the contact; carry out the plan again"
        )
    centre, contours = arms[-1, 0][0], []
    # A switch has no force.
    noise = float(np.hypot(tip.noise_std, tip.error_std))
    for k, plane in enumerate(plan.planes):
        ahead, behind = (np.reshape(arms.get((k, side), []), (-1, 3)) for side in (0, 1))
        first, last = (
            ContourEnd.TURNED_AWAY if (k, side) in missed else ContourEnd.LENGTH_REACHED
            for side in (1, 0)
        )
        points, own = np.vstack([behind[::-1], centre, ahead]), SamplingPlane(centre, plane.normal)
        contours.append(Contour(points, own, noise, (first, last)))
    return touch_of_centres(plan, centre, contours, tip)
