"""Bodies with sharp edges, explored once each; every test gets its own copy."""

import numpy as np

from tests.explored import Explored, explore_body
from tests.kept import kept_once
from touchatlas.planner import PlannerOptions
from touchatlas.sim import make_object
from touchatlas.sim.world.implicit_fields import polyhedron, union
from touchatlas.sim.world.implicit_object import ImplicitObject


def box(low, high):
    """The field of an upright box."""
    levels = np.concatenate([np.asarray(high, float), -np.asarray(low, float)])
    return polyhedron(np.concatenate([np.eye(3), -np.eye(3)]), levels)


def _roof(slope: float):
    """A box under a roof of two slopes: the normals at its ridge differ by twice the slope."""
    s, c = np.sin(slope), np.cos(slope)
    sides = np.array([[0, 1, 0], [0, -1, 0], [0, 0, -1], [1, 0, 0], [-1, 0, 0]], float)
    normals = np.concatenate([[[s, 0, c], [-s, 0, c]], sides])
    return polyhedron(normals, [10 * c, 10 * c, 25, 25, 20, 25, 25])


_FIELDS = {
    # A cube of 40, two thirds of the built-in one: half as many touches.
    "block": (box((-20, -20, -20), (20, 20, 20)), (20, 20, 20)),
    # A step: one concave edge among convex ones.
    "step": (
        union(box((-30, -20, -20), (30, 20, 0)), box((-30, -20, -20), (0, 20, 15))),
        (30, 20, 20),
    ),
    "roof": (_roof(np.deg2rad(25.0)), (25, 25, 20)),
    # A wall 6 thick: its two faces are as near to each other as samples are to an edge.
    "wall": (box((-20, -20, -3), (20, 20, 3)), (20, 20, 3)),
    # Two blocks of one height on a base, with a slot 12 wide between them.
    "slot": (
        union(
            box((-30, -20, -15), (30, 20, -5)),
            union(box((-30, -20, -15), (-6, 20, 10)), box((6, -20, -15), (30, 20, 10))),
        ),
        (30, 20, 15),
    ),
}


def sharp_object(name: str):
    """A body with sharp edges, 0.02 of noise and 0.1 of tolerance."""
    if name not in _FIELDS:
        return make_object(name)
    return ImplicitObject(name, "", *_FIELDS[name], 0.02, 0.1)


def explored_sharp(name: str) -> Explored:
    """A copy of an exploration of a body with sharp edges, with contours that run over them."""
    return explored_faces(name, PlannerOptions().max_turn)


@kept_once
def explored_faces(name: str, max_turn: float) -> Explored:
    """The same with contours that turn by so much at most, and of 17 samples on each arm instead of
    43: the same follows in less than half of the time."""
    options = PlannerOptions(max_turn=max_turn, step=0.035)
    return explore_body(sharp_object(name), 100, options=options)
