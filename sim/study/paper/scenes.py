"""Stand-ins for the paper's objects, and the touches that its tables and figures need."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.patch.geometry.arrays import cross
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.study.scenes import POINTS_PER_ARM, REACH
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe

# How accurate the paper's Adept robot is.
NOISE = 0.02
# All arms of a touch are as long as the first to turn by this much, and no longer than REACH.
TURN = np.pi / 4.0
# From the first principal direction to the first plane: no curve follows a symmetry.
_HEADING = np.deg2rad(10.0)
# Steps in which the length of the arms is found.
_FINE = 400
_NECK_HEIGHT, _SHOULDER_HEIGHT = 45.0, 24.0


@dataclass(frozen=True, eq=False)
class Place:
    """A reference point on an object, with the exact answer.

    Parameters
    ----------
    surface : ImplicitObject
    point, normal : (3,) float, world
    k1, k2 : float, 1/length
        k1 >= k2; convex is negative.
    directions : (2, 3) float, unit, world
        Of k1 and of k2.
    """

    surface: ImplicitObject
    point: np.ndarray
    normal: np.ndarray
    k1: float
    k2: float
    directions: np.ndarray


def place_at(name: str, near) -> Place:
    """The place of a built-in object next to a point (3,)."""
    obj = make_object(name)
    assert isinstance(obj, ImplicitObject)
    point = obj.project(np.array([near], dtype=float))
    k1, k2, directions = obj.principal_curvatures(point)
    return Place(obj, point[0], obj.normal(point)[0], float(k1[0]), float(k2[0]), directions[0])


def neck() -> Place:
    """In the bottle's neck, where its principal curvatures are nearest to the paper's."""
    return place_at("bottle", [20.0, 0.0, _NECK_HEIGHT])


def shoulder() -> Place:
    """On the bottle's shoulder, where it is most convex."""
    return place_at("bottle", [28.0, 0.0, _SHOULDER_HEIGHT])


def mouse_back() -> Place:
    """On the back of the mouse."""
    return place_at("mouse", [8.0, -2.0, 19.0])


def ball() -> Place:
    """On the sphere of radius 33."""
    return place_at("sphere", np.full(3, 33.0 / np.sqrt(3.0)))


def quadrant(count: int) -> list[Place]:
    """Places along the quadrant of the ellipse where y = 1 cuts the ellipsoid 8/5/3.

    Even in the ellipse's angle, from (0, 1, 6 sqrt 6 / 5) to (16 sqrt 6 / 5, 1, 0): the paper's
    figure 6.
    """
    angles = np.linspace(0.0, 0.5 * np.pi, count)
    along, up = 3.2 * np.sqrt(6.0) * np.sin(angles), 1.2 * np.sqrt(6.0) * np.cos(angles)
    return [place_at("ellipsoid_paper", [x, 1.0, z]) for x, z in zip(along, up, strict=True)]


def plan_at(
    place: Place,
    planes: int,
    points: int = POINTS_PER_ARM,
    reach: float = REACH,
    turn: float = TURN,
) -> ProbePlan:
    """A visit that tracks even points both ways in planes through the normal, evenly apart.

    Parameters
    ----------
    place : Place
    planes : int
    points : int
        Of each arm, the reference point not counted.
    reach, turn : float, length and rad
        All arms are as long as the first to turn so much, and no longer than the reach.
    """
    e1, e2 = place.directions
    heading = np.cos(_HEADING) * e1 + np.sin(_HEADING) * e2
    chosen = concurrent_planes(place.point, place.normal, heading, planes)
    normals = np.array([plane.normal for plane in chosen])
    ahead = cross(place.normal[None], normals)
    step = reach / _FINE
    arms = place.surface.trace_arms(
        place.point, np.tile(normals, (2, 1)), np.concatenate([ahead, -ahead]), reach, step, turn
    )
    length = step * min(len(path) for path, _ in arms)
    return ProbePlan(
        0, place.point, place.normal, chosen, length, length / points, np.pi, Reason.START
    )


def touches(
    place: Place, plan: ProbePlan, draws: int, rng: np.random.Generator, noise: float = NOISE
) -> Iterator[Touch]:
    """The same visit again and again, each time with fresh noise."""
    probe = Probe(place.surface, noise, rng)
    for _ in range(draws):
        yield probe(plan)
