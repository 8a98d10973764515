"""Plans as a program for LinuxCNC, for machines that are not on a network.

Each plan writes a log of its own, since an aborted program loses what is open. ``PROBEOPEN`` logs
each probing move, nine numbers a line, in the active work system and the units in force. All moves
are probing moves, so a log shows by its order which line is what.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.words import count_of
from touchatlas.planner.drivers.guarded import GuardOptions, millimetres_of
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import TriggerOptions

_UNITS = {"mm": "G21", "in": "G20"}
# Moves to a point, measures, and leaves it; what the point met decides whether its arm goes on.
_SUBROUTINES = """\
o<way> sub (to #1 #2 #3; contact ends the program)
  G38.3 X#1 Y#2 Z#3 F#<_touch_travel>
  o110 if [#5070 EQ 1]
    (PROBECLOSE)
    (MSG,contact on a way that was to be free)
    M2
  o110 endif
o<way> endsub

o<point> sub (from #1 #2 #3 toward #4 #5 #6; leave by #7 #8 #9)
  o120 if [#<_touch_met> EQ 1]
    o<way> call [#1] [#2] [#3]
    G38.3 X#4 Y#5 Z#6 F#<_touch_feed>
    #<_touch_met> = #5070
    o121 if [#<_touch_met> EQ 1]
      G38.5 X[#5061 + #7] Y[#5062 + #8] Z[#5063 + #9] F#<_touch_feed>
      o122 if [#5070 EQ 0]
        (PROBECLOSE)
        (MSG,the probe stays closed)
        M2
      o122 endif
      G4 P0.1
    o121 endif
    o<way> call [#1] [#2] [#3]
  o120 endif
o<point> endsub

o<back> sub (from the last arm to #1 #2 #3; without contact the tip is there)
  o130 if [#<_touch_made> EQ 1]
    o<way> call [#1] [#2] [#3]
  o130 endif
o<back> endsub
"""


@dataclass(frozen=True, eq=False)
class Measure:
    """A point that is measured: the plane of its arm, -1 for the contact; the side; the straight
    way of the centre of the tip, (3,) to (3,)."""

    plane: int
    side: int
    start: np.ndarray
    target: np.ndarray

    @property
    def direction(self) -> np.ndarray:
        """(3,) unit."""
        way = self.target - self.start
        found: np.ndarray = way / np.linalg.norm(way)
        return found


def star_of(plan: ProbePlan, options: TriggerOptions) -> list[Measure]:
    """Points of a plan that need no answer before they are written: the contact, and in each plane
    some each way, a fraction of the reach apart on the tangent plane that is expected.

    They are looked for as far above and below that plane as the contact is. What is learned and
    planned are centres of the tip.
    """
    n, origin, depth = plan.normal, plan.begin(), plan.depth
    height = float((origin - plan.reference_point) @ n)
    found = [Measure(-1, 0, origin, origin - depth * n)]
    step = plan.reach / options.points
    for k, plane in enumerate(plan.planes):
        up = n - (n @ plane.normal) * plane.normal
        up /= np.linalg.norm(up)
        along = cross(n[None], plane.normal[None])[0]
        along /= np.linalg.norm(along)
        for side, ahead in enumerate((along, -along)):
            for place in range(1, options.points + 1):
                expected = plan.reference_point + place * step * ahead
                start = expected + height * up
                found.append(Measure(k, side, start, start - depth * up))
    return found


def linuxcnc_program(
    plans: Sequence[ProbePlan],
    options: TriggerOptions = TriggerOptions(),
    motion: GuardOptions = GuardOptions(),
    unit: str = "mm",
    name: str = "touch",
) -> str:
    """A program that carries out plans and writes a log for each, NAME-0003.txt for plan 3.

    It uses the active work system, without a tool length, and probing moves alone: contact on the
    way ends it. Between plans the tip goes by their safe ways; at the beginning and the end, and
    where no way is known to be clear, by the clearance above all points, along z.

    Parameters
    ----------
    plans : sequence of ProbePlan
        For centres of the tip, as those of an atlas that learns these.
    options : TriggerOptions
    motion : GuardOptions
    unit : str
        mm or in: that of all lengths here.
    name : str
        Of the logs: letters, digits, - and _.
    """
    millimetres = millimetres_of(unit)
    if not plans:
        raise ValueError("there are no plans; give those that Planner.ask has returned")
    if not name.replace("-", "").replace("_", "").isalnum():
        raise ValueError(f"name is {name!r}; it must be of letters, digits, - and _")
    stars = [star_of(plan, options) for plan in plans]
    starts = np.array([measure.start for star in stars for measure in star])
    apart = min(
        float(np.linalg.norm(np.diff([m.start for m in star], axis=0), axis=1).min())
        for star in stars
    )
    # LinuxCNC refuses probing moves shorter than 0.01 inches; with some room.
    if apart * millimetres < 0.3:
        raise ValueError(
            f"points are {apart:.3g} apart, nearer than LinuxCNC probes, 0.3 mm; give "
            "fewer points an arm, or a larger reach"
        )
    safe = float(starts[:, 2].max()) + options.clearance
    lines = [
        f"(touchatlas: {count_of(len(plans), 'plan')}, {count_of(len(starts), 'point')})",
        f"G17 {_UNITS[unit]} G40 G49 G80 G90 G94",
        f"#<_touch_feed> = {60.0 * motion.feed:.4f}",
        f"#<_touch_travel> = {60.0 * motion.travel:.4f}",
        "",
        _SUBROUTINES,
    ]
    before: np.ndarray | None = None
    for plan, star in zip(plans, stars, strict=True):
        above = np.append(star[0].start[:2], safe)
        way = above[None]
        if before is not None:
            clear = plan.way_from(before) if plan.way is not None else None
            over = np.stack([np.append(before[:2], safe), above])
            # The last point of a clear way is where the contact is measured from.
            way = over if clear is None else clear[:-1]
        before = star[0].start
        lines += [f"(plan {plan.number})", *(f"o<way> call {_numbers(point)}" for point in way)]
        lines += [f"(PROBEOPEN {log_name(plan, name)})"]
        arm = (-1, 0)
        for measure in star:
            met = "1" if measure.plane < 0 else "#<_touch_made>"
            if measure.plane < 0 or (measure.plane, measure.side) != arm:
                lines.append(f"#<_touch_met> = {met}")
            arm = measure.plane, measure.side
            leave = -motion.release * measure.direction
            numbers = np.concatenate([measure.start, measure.target, leave])
            lines.append(f"o<point> call {_numbers(numbers)}")
            if measure.plane < 0:
                lines.append("#<_touch_made> = #<_touch_met>")
        lines += ["(PROBECLOSE)", f"o<back> call {_numbers(before)}", ""]
    return "\n".join([*lines, f"o<way> call {_numbers(above)}", "M2", ""])


def log_name(plan: ProbePlan, name: str = "touch") -> str:
    """The file that the program of a plan writes."""
    return f"{name}-{plan.number:04d}.txt"


def _numbers(values) -> str:
    """Arguments of a subroutine."""
    return " ".join(f"[{x:.6f}]" for x in values)
