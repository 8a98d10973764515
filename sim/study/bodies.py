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

Distance = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Placed:
    """A body after x -> scale x + shift, with what the probe and the judge ask of it: each method
    is that of ImplicitObject."""

    body: ImplicitObject
    scale: float
    shift: np.ndarray

    @property
    def closed(self) -> bool:
        return self.body.closed

    @property
    def euler_characteristic(self) -> int:
        return self.body.euler_characteristic

    def _there(self, points):
        return self.scale * points + self.shift

    def _back(self, points):
        return (points - self.shift) / self.scale

    @property
    def diagonal(self) -> float:
        return self.scale * self.body.diagonal

    def start(self):
        point, outward = self.body.start()
        return self._there(point), outward

    def sample(self, count: int, rng):
        points, normals = self.body.sample(count, rng)
        return self._there(points), normals

    def mesh(self, sagitta: float):
        vertices, faces = self.body.mesh(sagitta / self.scale)
        return self._there(vertices), faces

    def contact(self, origin, direction, length: float):
        found = self.body.contact(self._back(origin), direction, length / self.scale)
        return None if found is None else self._there(found)

    def is_inside(self, point) -> bool:
        return self.body.is_inside(self._back(point))

    def trace_arms(self, point, plane_normals, directions, reach, step, max_turn, step_turn=np.pi):
        lengths = reach / self.scale, step / self.scale
        planes = plane_normals, directions
        arms = self.body.trace_arms(self._back(point), *planes, *lengths, max_turn, step_turn)
        return [(self._there(points), end) for points, end in arms]


Body = ImplicitObject | MeshObject | Placed


def implicit(name: str, field: Field, half_extent, euler: int = 2) -> ImplicitObject:
    """An object with the usual noise and tolerance."""
    size = tuple(float(x) for x in half_extent)
    return ImplicitObject(name, name, field, size, NOISE * TOLERANCE, TOLERANCE, euler)


def numeric(distance: Distance, step: float = 1e-4, wide: float = 1e-3) -> Field:
    """A field of a smooth function, with its derivatives by central differences.

    With these steps (mm) truncation and rounding are below 1e-8 in first derivatives, and below
    1e-6 in second ones.
    """

    def moved(points, by: float):
        return np.concatenate([points + by * s * axis for axis in np.eye(3) for s in (1.0, -1.0)])

    def first_order(points):
        every = distance(np.concatenate([points, moved(points, step)])).reshape(7, -1)
        gradient = (every[1::2] - every[2::2]) / (2.0 * step)
        return every[0], np.ascontiguousarray(gradient.T)

    def hessian(points):
        every = first_order(moved(points, wide))[1].reshape(6, -1, 3)
        return ((every[::2] - every[1::2]) / (2.0 * wide)).transpose(1, 0, 2)

    return Field(first_order, hessian)


def joined(first, second, width: float = 4.0) -> np.ndarray:
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

    def distance(points):
        inside = -slot.first_order(points - np.array([20.0, 0.0, 0.0]))[0]
        return -joined(-block.first_order(points)[0], -inside, min(4.0, gap))

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
        along, side = a * x - b * z, b * x + a * z - large
        tip = np.where(along > a * height, np.hypot(x - height, z) - radius, side)
        return np.where(along < 0.0, np.hypot(x, z) - large, tip)

    return implicit("spike", numeric(distance), (37.5 + radius, 22.01, 22.01))


def dimpled(width: float) -> ImplicitObject:
    """A ball with a dent 0.7 widths deep at its side."""
    dent = [[33.0, 0.0, 0.0]], [width], [1.4 * width / 33.0]
    return implicit("dimpled", quadric_with_bumps((33.0,) * 3, *dent), (33.01,) * 3)


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
    size = (27.2 + centres[-1], 27.2, 8.2 + 4.0 / 6.0)
    return implicit("handles", numeric(distance), size, 2 - 2 * genus)


def two_balls(gap: float) -> ImplicitObject:
    """Two balls of radius 20."""
    away = np.array([20.0 + 0.5 * gap, 0.0, 0.0])

    def distance(points):
        return np.min([np.linalg.norm(points - x, axis=1) for x in (away, -away)], axis=0) - 20.0

    return implicit("two balls", numeric(distance), (40.01 + 0.5 * gap, 20.01, 20.01), 4)


def cup(missing: float) -> MeshObject:
    """A ball of radius 33 without this fraction of its area below, open there: cut by a plane
    (Archimedes: the area of a zone goes with its height)."""
    angle = np.linspace(np.pi - np.arccos(1.0 - 2.0 * missing), 0.0, 129)
    arc = 33.0 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    ball = trimesh.creation.revolve(arc, sections=256)
    return MeshObject("cup", ball.vertices, ball.faces)
