"""A plan carried out by a machine that scans: approach, then an arm each way in each plane."""

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import cross, length_of_way
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.arms import Arm, of_centres, touch_of, untracked
from touchatlas.planner.tracking.going import arrives
from touchatlas.planner.tracking.hybrid_control import centre_of
from touchatlas.planner.tracking.machines import Scanner
from touchatlas.planner.tracking.options import Tip, TrackingOptions
from touchatlas.planner.tracking.tracker import Tracker


def track_plan(
    scanner: Scanner,
    plan: ProbePlan,
    tip: Tip = Tip(),
    options: TrackingOptions = TrackingOptions(),
    arms: list[Arm] | None = None,
    normals: bool = True,
) -> Touch:
    """Carry out a plan with a machine that scans.

    Parameters
    ----------
    scanner : Scanner
    plan : ProbePlan
    tip : Tip
    options : TrackingOptions
    arms : list, optional
        Takes what came of each arm, in the order of the planes, forward before backward.
    normals : bool
        Whether the force tells the normals of the surface. Without them a touch holds centres, as
        all touches of its atlas have to, and the plan is for the centre.

    Returns
    -------
    Touch
        Contacts with their normals, beside their planes: a ball whose centre stays in a plane meets
        a surface that leans out of it beside the plane. Its way is that of the centre. Without
        normals centres, in the planes in which they lay.

    Raises
    ------
    ValueError
        For a reading that is not finite or comes before the last one; the machine stands still.
    """
    radius = tip.radius if normals else 0.0
    origin, depth = plan.begin(radius), plan.depth
    # A tip travels along plane normal x surface normal: each plane is gone through both ways.
    across = np.array([plane.normal for plane in plan.planes])
    ways = np.stack([-across, across], axis=1).reshape(-1, 3)
    tips, found, status = getattr(scanner, "tips", 1), [], TouchStatus.TOUCHED
    here = centre_of(scanner.read(), tip).reshape(-1, 3)[0]
    way = plan.way_from(here, radius)
    travel = 0.0 if way is None else length_of_way(np.vstack([here, way]))
    for first in range(0, len(ways), tips):
        tracker = Tracker(scanner, plan, ways[first : first + tips], tip, options, radius)
        status = TouchStatus.UNREACHABLE
        if arrives(scanner, here, way):
            status = tracker.approach(origin, depth)
        if status is not TouchStatus.TOUCHED:
            break
        found += tracker.track()
        # Further arms begin where contact is known to be.
        above = tracker.start[0] + options.retract * plan.normal
        back = _way_back(*tracker.travelled(), ways[first], options.retract, above)
        travel += length_of_way(back)
        if not arrives(scanner, back[0], back[1:]):
            # The tip waits where the arm ended: nothing else is known to be free.
            status = TouchStatus.UNREACHABLE
            break
        here, way = above, above[None]
    if status is not TouchStatus.UNREACHABLE:
        scanner.move(origin[None])
    if found:
        # What was tracked before an arm could not be reached is kept.
        found += [untracked()] * (len(ways) - len(found))
        status = TouchStatus.TOUCHED
    if arms is not None:
        arms += found
    shared = float(np.hypot(tip.radius_std, options.force / tip.stiffness * tip.stiffness_std))
    touch = touch_of(plan, origin, depth, status, found, tip, travel, shared)
    return touch if normals else of_centres(touch, tip.radius)


def _way_back(centres, travelled, w, height: float, goal) -> np.ndarray:
    """(k, 3) from where a tip is to a goal (3,) above the contact, lifted over the places (n, 3)
    where it was; side by side, all tips go back where the first one was."""
    return np.vstack([centres[-1:], _lifted(centres, travelled, w, height), goal])


def _lifted(centres, travelled, w, height: float) -> np.ndarray:
    """(k, 3) a path of centres (n, 3) gone back, lifted off the surface within its plane, with
    points about a height apart; ``travelled`` (n,) along it, length, which the noise of a tip at
    rest does not count in."""
    marks = np.floor(travelled / height).astype(int)
    places = np.flatnonzero(np.append(True, np.diff(marks) > 0))
    path = centres[places]
    if len(path) < 2:
        return np.zeros((0, 3))
    tangents = np.gradient(path, axis=0)
    up = cross(tangents, np.broadcast_to(w, tangents.shape))
    up /= np.maximum(np.sqrt((up * up).sum(axis=1)), 1e-300)[:, None]
    return (path + height * up)[::-1]
