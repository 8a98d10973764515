"""Bodies of the families, in millimetres, with a diagonal of about a hundred."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh

from touchatlas.sim.world.implicit_fields import Field, quadric_with_bumps, rounded_box
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# Tolerance of bodies where it is not the severity, mm, and noise over the tolerance.
TOLERANCE, NOISE = 0.1, 0.2
# Steps of first and second central differences, mm: truncation and rounding are then both below
# 1e-8, and 1e-6.
_STEP, _WIDE = 1e-4, 1e-3
# Width of the smooth joint of two bodies, mm.
_JOINT = 4.0

Distance = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Placed:
    """A body after x -> scale x + shift, with what the probe and the judge ask of it."""

    body: ImplicitObject
    scale: float
    shift: np.ndarray

    @property
    def closed(self) -> bool:
        return self.body.closed

    @property
    def diagonal(self) -> float:
        return self.scale * self.body.diagonal

    @property
    def euler_characteristic(self) -> int:
        return self.body.euler_characteristic

    def start(self):
        """As of ImplicitObject."""
        point, outward = self.body.start()
        return self.scale * point + self.shift, outward

    def sample(self, count: int, rng):
        """As of ImplicitObject."""
        points, normals = self.body.sample(count, rng)
        return self.scale * points + self.shift, normals

    def mesh(self, sagitta: float):
        """As of ImplicitObject."""
        vertices, faces = self.body.mesh(sagitta / self.scale)
        return self.scale * vertices + self.shift, faces

    def contact(self, origin, direction, length: float):
        """As of ImplicitObject."""
        start = (origin - self.shift) / self.scale
        found = self.body.contact(start, direction, length / self.scale)
        return None if found is None else self.scale * found + self.shift

    def is_inside(self, point) -> bool:
        """As of ImplicitObject."""
        return self.body.is_inside((point - self.shift) / self.scale)

    def trace_arms(self, point, plane_normals, directions, reach, step, max_turn, step_turn=np.pi):
        """As of ImplicitObject."""
        start, unit = (point - self.shift) / self.scale, self.scale
        arms = self.body.trace_arms(
            start, plane_normals, directions, reach / unit, step / unit, max_turn, step_turn
        )
        return [(unit * points + self.shift, end) for points, end in arms]


def implicit(name: str, field: Field, half_extent, euler: int = 2) -> ImplicitObject:
    """An object with the usual noise and tolerance."""
    size = tuple(float(x) for x in half_extent)
    return ImplicitObject(name, name, field, size, NOISE * TOLERANCE, TOLERANCE, euler)


def numeric(distance: Distance) -> Field:
    """A field of a smooth function, with its derivatives by central differences."""

    def first_order(points):
        moved = [points + _STEP * sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
        every = distance(np.concatenate([points, *moved])).reshape(7, -1)
        gradient = (every[1::2] - every[2::2]) / (2.0 * _STEP)
        return every[0], np.ascontiguousarray(gradient.T)

    def hessian(points):
        moved = [points + _WIDE * sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
        every = first_order(np.concatenate(moved))[1].reshape(6, -1, 3)
        return ((every[::2] - every[1::2]) / (2.0 * _WIDE)).transpose(1, 0, 2)

    return Field(first_order, hessian)


def joined(first, second, width: float = _JOINT) -> np.ndarray:
    """(n,) smooth minimum of two distances (Quilez, Smooth minimum, 2013, cubic)."""
    overlap = np.maximum(width - np.abs(first - second), 0.0) / width
    return np.minimum(first, second) - overlap**3 * width / 6.0


def lumpy(rng) -> ImplicitObject:
    """An ellipsoid with random bumps and dents."""
    centres = rng.normal(size=(8, 3))
    centres *= np.array([40.0, 30.0, 22.0]) / np.linalg.norm(centres, axis=1)[:, None]
    widths, sizes = rng.uniform(10.0, 16.0, 8), rng.uniform(-0.25, 0.2, 8)
    field = quadric_with_bumps((40.0, 30.0, 22.0), centres, widths, sizes)
    return implicit("lumpy", field, (52.0, 40.0, 30.0))


def slab(thickness: float) -> ImplicitObject:
    """A plate with round rims."""
    sides = np.array([35.0, 25.0, 0.5 * thickness])
    return implicit("slab", rounded_box(sides, 0.98 * sides[2]), sides + 0.01)


def fork(gap: float) -> ImplicitObject:
    """A block with a slot that is open on three sides, its bottom and rims round."""
    block = rounded_box((35.0, 16.0, 18.0), 6.0)
    slot = rounded_box((35.0, 60.0, 0.5 * gap), 0.49 * gap)
    shift = np.array([20.0, 0.0, 0.0])

    def distance(points):
        inside = -slot.first_order(points - shift)[0]
        return -joined(-block.first_order(points)[0], -inside, min(_JOINT, gap))

    return implicit("fork", numeric(distance), (35.01, 16.01, 18.01))


def box(fillet: float) -> ImplicitObject:
    """A box with rounded edges."""
    return implicit("box", rounded_box((32.0, 24.0, 18.0), fillet), (32.01, 24.01, 18.01))


def spike(radius: float) -> ImplicitObject:
    """A cone between balls of radius 22 and of the given one (Quilez, Round cone, 2018)."""
    large, height = 22.0, 50.0
    b = (large - radius) / height
    a = np.sqrt(1.0 - b * b)

    def distance(points):
        x, z = points[:, 0] + 0.5 * height - 10.0, np.hypot(points[:, 1], points[:, 2])
        along = a * x - b * z
        side = b * x + a * z - large
        end = np.hypot(x - height, z) - radius
        return np.where(
            along < 0.0, np.hypot(x, z) - large, np.where(along > a * height, end, side)
        )

    return implicit("spike", numeric(distance), (37.5 + radius, 22.01, 22.01))


def dimpled(width: float) -> ImplicitObject:
    """A ball with a dent 0.7 widths deep at its side."""
    depth = [1.4 * width / 33.0]
    field = quadric_with_bumps((33.0,) * 3, [[33.0, 0.0, 0.0]], [width], depth)
    return implicit("dimpled", field, (33.01,) * 3)


def handles(genus: int) -> ImplicitObject:
    """A row of rings; none: an ellipsoid."""
    if genus == 0:
        return implicit("handles", quadric_with_bumps((40.0, 30.0, 22.0)), (40.01, 30.01, 22.01))
    centres = 34.0 * (np.arange(genus) - 0.5 * (genus - 1))

    def distance(points):
        x, y, z = points.T
        rings = [np.hypot(np.hypot(x - c, y) - 19.0, z) - 8.0 for c in centres]
        found = rings[0]
        for ring in rings[1:]:
            found = joined(found, ring)
        return found

    # Where two rings cross, the smooth minimum is a sixth of its width thicker.
    size = (27.2 + centres[-1], 27.2, 8.2 + _JOINT / 6.0)
    return implicit("handles", numeric(distance), size, 2 - 2 * genus)


def two_balls(gap: float) -> ImplicitObject:
    """Two balls of radius 20."""
    shift = np.array([20.0 + 0.5 * gap, 0.0, 0.0])

    def distance(points):
        return (
            np.minimum(
                np.linalg.norm(points - shift, axis=1), np.linalg.norm(points + shift, axis=1)
            )
            - 20.0
        )

    return implicit("two balls", numeric(distance), (40.01 + 0.5 * gap, 20.01, 20.01), 4)


def cup(missing: float) -> MeshObject:
    """A ball of radius 33 without this fraction of its area below, open there: cut by a plane
    (Archimedes: the area of a zone goes with its height)."""
    angle = np.linspace(np.pi - np.arccos(1.0 - 2.0 * missing), 0.0, 129)
    arc = 33.0 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    ball = trimesh.creation.revolve(arc, sections=256)
    return MeshObject("cup", ball.vertices, ball.faces)
