"""Scenes for one patch: three curves to fit, nine others to verify, and the exact answer."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.arrays import cross
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object

# Longest arm of a touch, and points of an arm, the reference point not counted: the paper's.
REACH, POINTS_PER_ARM = 20.0, 9


@dataclass(frozen=True, eq=False)
class Scene:
    """One reference point with tracked curves around it.

    Parameters
    ----------
    surface : ImplicitObject
        The truth.
    point, normal : (3,) float, world
        Exact.
    contact : (3,) float, length, world
        The reference point as a probe reports it: with noise.
    k1, k2 : float, 1/length
        Exact principal curvatures, k1 >= k2.
    contours : tuple of Contour
        With noise, to be fitted.
    verifying : (v, 3) float, length, world
        Exact points on other curves through the reference point, which is among them.
    reach : float, length
        Arc length of each arm.
    noise_std : float, length
    """

    surface: ImplicitObject
    point: np.ndarray
    normal: np.ndarray
    contact: np.ndarray
    k1: float
    k2: float
    contours: tuple[Contour, ...]
    verifying: np.ndarray
    reach: float
    noise_std: float


def draw_scene(
    surface: str,
    noise_std: float,
    tilt: float,
    rng: np.random.Generator,
    sections: int = 3,
    turn: float = np.pi / 4.0,
    reach: float = REACH,
    points: int = POINTS_PER_ARM,
    verifying: int = 9,
) -> Scene:
    """A scene at a random reference point and heading.

    Parameters
    ----------
    surface : str
        One of ``SURFACES``.
    noise_std : float, length
    tilt : float, rad
        Each sampling plane is turned out of the normal by up to this much.
    sections, verifying : int
        Curves to fit, and others.
    turn : float, rad
        All arms are as long as the first to turn by this much,
    reach : float, length
        and no longer than this.
    points : int
        Of each arm, the reference point not counted.
    """
    if surface not in SURFACES:
        raise ValueError(f"{surface!r} is no surface of a scene; choose {', '.join(SURFACES)}")
    name, where = SURFACES[surface]
    obj = _object(name)
    point = where(obj, rng)
    normal = obj.normal(point[None])[0]
    planes = [
        _tilted(plane, normal, tilt * rng.uniform(-1.0, 1.0))
        for plane in concurrent_planes(point, normal, rng.normal(size=3), sections)
    ]
    others = concurrent_planes(point, normal, rng.normal(size=3), verifying)
    length = arm_length(obj, point, normal, [*planes, *others], reach, turn)
    # One step in a hundred more: the last point must not be lost to rounding.
    ahead, behind = _arms(
        obj, point, normal, [*planes, *others], 1.01 * length, length / points, np.pi
    )
    curves = [
        np.concatenate([back[::-1], point[None], front])
        for front, back in zip(ahead, behind, strict=True)
    ]
    k1, k2, _ = obj.principal_curvatures(point[None])
    return Scene(
        *(obj, point, normal, point + noise_std * rng.normal(size=3), float(k1[0]), float(k2[0])),
        tuple(_tracked(c, p, noise_std, rng) for c, p in zip(curves, planes, strict=False)),
        *(np.concatenate(curves[sections:]), length, noise_std),
    )


def arm_length(obj, point, normal, planes, reach: float, turn: float, steps: int = 80) -> float:
    """Length of the arms both ways in some planes: all are as long as the first to turn by an
    angle, and no longer than the reach, of which it is a whole number of ``steps``."""
    arms = _arms(obj, point, normal, planes, reach, reach / steps, turn)
    return reach / steps * min(len(path) for side in arms for path in side)


def _arms(obj, point, normal, planes, reach: float, step: float, turn: float):
    """Points (n, 3) of the arms ahead in each plane, and of those behind."""
    normals = np.array([plane.normal for plane in planes])
    ahead = cross(normal[None], normals)
    traced = obj.trace_arms(
        point, np.tile(normals, (2, 1)), np.concatenate([ahead, -ahead]), reach, step, turn
    )
    paths = [path for path, _ in traced]
    return paths[: len(planes)], paths[len(planes) :]


def _tilted(plane: SamplingPlane, normal, angle: float) -> SamplingPlane:
    """The plane turned about its own tangent through its point."""
    return SamplingPlane(plane.point, np.cos(angle) * plane.normal + np.sin(angle) * normal)


def _tracked(curve, plane: SamplingPlane, noise_std: float, rng) -> Contour:
    """What a probe reports of a curve."""
    ends = (ContourEnd.LENGTH_REACHED, ContourEnd.LENGTH_REACHED)
    return Contour(curve + noise_std * rng.normal(size=curve.shape), plane, noise_std, ends)


def monkey_saddle(size: float = 4000.0) -> ImplicitObject:
    """z = (x^3 - 3 x y^2) / size over the plane; flat umbilic at the origin."""

    def first_order(points):
        x, y, z = points.T
        slopes = [-3.0 * (x * x - y * y) / size, 6.0 * x * y / size, np.ones_like(x)]
        return z - (x**3 - 3.0 * x * y * y) / size, np.stack(slopes, axis=1)

    def hessian(points):
        x, y, _ = points.T
        second = np.zeros((len(points), 3, 3))
        second[:, 0, 0], second[:, 1, 1] = -6.0 * x / size, 6.0 * x / size
        second[:, 0, 1] = second[:, 1, 0] = 6.0 * y / size
        return second

    field = Field(first_order, hessian)
    return ImplicitObject("monkey_saddle", "", field, (40.0,) * 3, 0.02, 0.1)


def _anywhere(obj, rng):
    return obj.sample(1, rng)[0][0]


def _at_neck(obj, rng):
    """A point of clearly negative Gaussian curvature."""
    points = obj.sample(400, rng)[0]
    k1, k2, _ = obj.principal_curvatures(points)
    return points[(k1 * k2 < 0.25 * (k1 * k2).min()).argmax()]


def _near_origin(obj, rng):
    return obj.project(np.array([[*rng.uniform(-10.0, 10.0, 2), 0.0]]))[0]


# Name of the object, and how a reference point is drawn.
SURFACES = {
    "ball": ("sphere", _anywhere),
    "ellipsoid": ("ellipsoid", _anywhere),
    "torus": ("torus", _anywhere),
    "bottle_neck": ("bottle", _at_neck),
    "mouse": ("mouse", _anywhere),
    "monkey_saddle": ("monkey_saddle", _near_origin),
}


@cache
def _object(name: str) -> ImplicitObject:
    made = monkey_saddle() if name == "monkey_saddle" else make_object(name)
    assert isinstance(made, ImplicitObject)
    return made
