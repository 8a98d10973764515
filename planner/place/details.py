"""Details: slips of the probe, rims and holes, in an order that no tolerance changes.

``sure`` tells of a length whether the share of the surface that is asked for is known to it.
"""

from touchatlas.planner.place.choose import Target, View, open_places, rim_target, slip_target
from touchatlas.planner.place.hole_list import HoleList, Sure


def detail_target(view: View, holes: HoleList, sure: Sure) -> Target | None:
    """A slip, rim or hole that is less sure than the surface elsewhere; None where none is, or too
    little is known."""
    holes.update(view, sure)
    if not holes.begun:
        return None
    target = slip_target(view)
    target = rim_target(view, 0.5 * holes.level) if target is None else target
    return holes.target(view, sure) if target is None else target


def is_whole(view: View, holes: HoleList, sure: Sure) -> bool:
    """Whether no slip, rim or hole is left that the tolerance of the atlas asks for.

    What is open is a hole of the surface, until that was drawn too often.
    """
    tolerance = view.atlas.tolerance
    holes.update(view, sure)
    if holes.any_left(view, tolerance) or not (holes.looks_left or not len(open_places(view)[0])):
        return False
    return slip_target(view) is None and rim_target(view, tolerance) is None


def last_target(view: View, holes: HoleList) -> Target | None:
    """A slip, rim or hole where touches elsewhere no longer help; None where none is left."""
    target = slip_target(view)
    target = rim_target(view, view.atlas.tolerance) if target is None else target
    if target is not None:
        return target
    holes.draw_to(view, view.atlas.tolerance)
    return holes.target(view, lambda _: True)
