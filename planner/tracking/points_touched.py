"""Touches of single points: centres of the tip, on arms each way in the planes of a plan."""

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import length_of_way
from touchatlas.patch.geometry.contour import Contour
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import Tip


def touch_of_centres(plan: ProbePlan, centre, contours: list[Contour], tip: Tip) -> Touch:
    """The touch of a plan that met something when the tip was at a centre (3,)."""
    origin = plan.begin()
    length = float((origin - centre) @ plan.normal)
    way = np.stack([origin, origin - length * plan.normal]) if length > 0.0 else None
    tracked = sum(length_of_way(contour.points) for contour in contours)
    lengths = float(tracked), 0.0
    place = plan.number, centre, plan.normal, tuple(contours)
    return Touch(*place, TouchStatus.TOUCHED, *lengths, way, tip.radius, tip.radius_std)


def touch_in_vain(plan: ProbePlan, status: TouchStatus, tip: Tip) -> Touch:
    """The touch of a plan without contact: one that was reached has passed the air of its way."""
    origin = plan.begin()
    ends = np.stack([origin, origin - plan.depth * plan.normal])
    way = ends if status is TouchStatus.NO_CONTACT else None
    place = plan.number, plan.reference_point, plan.normal, ()
    return Touch(*place, status, 0.0, 0.0, way, tip.radius, tip.radius_std)
