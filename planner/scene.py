"""A planner in three dimensions: what it knows, and what it wants."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.scene import (
    OPEN,
    PLANNED,
    TOUCHED,
    add_mesh,
    add_points,
    add_surface,
    new_plot,
    plane_corners,
)
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.places import Places

if TYPE_CHECKING:
    from k3d.plot import Plot


def planner_plot(attempts: Attempts, places: Places, tolerance: float, unit: str) -> "Plot":
    """The surface, its open rims, the contacts, and the planes of pending plans."""
    plot, touched = new_plot(unit), np.reshape(attempts.touched, (-1, 3))
    corners, faces = planes_of(attempts.plans)
    every = np.concatenate([touched, corners, places.rim])
    size = 0.02 * float(np.linalg.norm(np.ptp(every, axis=0))) if len(every) else 1.0
    if places.surface is not None:
        add_surface(plot, places.surface, "deviation", tolerance)
    add_points(plot, touched, size, "contacts", TOUCHED)
    add_points(plot, places.rim, 0.5 * size, "open places", OPEN)
    if len(faces):
        add_mesh(plot, corners, faces, "planes of the next plans", color=PLANNED, opacity=0.35)
    return plot


def planes_of(plans, most: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (4 n, 3), length, and triangles (2 n, 3) of the sampling planes of plans: squares
    about their reference points, as large as their arms reach, or half as large as ``most``,
    length, where that is given."""
    squares = [
        plane_corners(
            plan.reference_point, plane.normal, plan.normal, min(plan.reach, most or plan.reach)
        )
        for plan in plans
        for plane in plan.planes
    ]
    corners = np.arange(4 * len(squares)).reshape(-1, 4)
    faces = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return np.reshape(squares, (-1, 3)), faces
