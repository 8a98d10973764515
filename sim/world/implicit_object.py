"""An object given by an implicit function: exact normals, curvatures, contours, contacts."""

from functools import cached_property

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.world.implicit_contours import normals_at, trace_arms
from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.level_set import level_set_mesh, newton_projection
from touchatlas.sim.world.triangles import areas_of, sample_triangles, top_sample


class ImplicitObject:
    """A body f < 0 with the surface f = 0.

    Parameters
    ----------
    name, description : str
    field : Field
        Value, gradient and Hessian of f.
    half_extent : (3,) float, length
        The surface lies within this box about the origin.
    noise_std, tolerance : float, length
        Defaults for exploring it.
    euler_characteristic : int
    triangles : (v, 3) float, length, and (f, 3) int, optional
        The surface of a body with plane faces, exactly. Without them the truth is a mesh of f = 0,
        whose cubes cut off sharp edges.
    """

    closed = True

    def __init__(
        self,
        name,
        description,
        field: Field,
        half_extent,
        noise_std,
        tolerance,
        euler_characteristic=2,
        triangles: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.name, self.source, self.description, self.field = name, name, description, field
        self._half_extent = np.asarray(half_extent, dtype=float)
        self.noise_std, self.tolerance = float(noise_std), float(tolerance)
        self.euler_characteristic = euler_characteristic
        self._triangles = triangles
        self._meshes: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def has_plane_faces(self) -> bool:
        """Whether the triangles of ``mesh`` are the surface exactly."""
        return self._triangles is not None

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3) lowest and highest corner of the bounding box, length."""
        vertices, _ = self.mesh(self.tolerance)
        return np.array([vertices.min(axis=0), vertices.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, length."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))

    @cached_property
    def area(self) -> float:
        """Area of the surface, length^2, from the truth mesh."""
        return float(areas_of(*self.mesh(0.05 * self.tolerance)).sum())

    def value(self, points) -> np.ndarray:
        """(n,) f at points (n, 3)."""
        return self.field.first_order(points)[0]

    def normal(self, points) -> np.ndarray:
        """(n, 3) outward unit normals at surface points."""
        return normals_at(self.field, points)

    def principal_curvatures(self, points):
        """k1, k2 (n,) and directions (n, 2, 3) at surface points.

        Eigenvalues of the shape operator -P H P / |grad f| on the tangent plane, P the
        projection on it: positive where the surface bends toward the outward normal.
        """
        _, gradient, hessian = self.field(points)
        length = np.sqrt((gradient**2).sum(axis=1))
        normal = gradient / length[:, None]
        along = np.eye(3)[np.abs(normal).argmin(axis=1)]
        e1 = along - (along * normal).sum(axis=1)[:, None] * normal
        e1 /= np.sqrt((e1**2).sum(axis=1))[:, None]
        tangents = np.stack([e1, cross(normal, e1)], axis=1)
        shape = -tangents @ hessian @ tangents.transpose(0, 2, 1) / length[:, None, None]
        values, vectors = np.linalg.eigh(shape)
        directions = vectors.transpose(0, 2, 1)[:, ::-1] @ tangents
        return values[:, 1], values[:, 0], directions

    def project(self, points) -> np.ndarray:
        """(n, 3) points moved onto the surface along the gradient (Newton)."""
        return newton_projection(self.field, points)

    def start(self):
        """Point where a flat plate lowered on the object meets it, and the direction up."""
        return top_sample(self.sample(4000, np.random.default_rng(0))[0]), np.array([0.0, 0.0, 1.0])

    def contact(self, origin, direction, length: float):
        """First point where a segment that does not begin inside enters the body, (3,), or None."""
        low, high = 0.0, length
        if length > 2.0 * np.linalg.norm(self._half_extent):
            # Steps of a long segment would pass a thin body.
            low, high = self._near(origin, direction, length)
        for _ in range(3):
            t = np.linspace(low, high, 65)
            inside = self.value(origin + t[:, None] * direction) < 0.0
            if not inside.any():
                return None
            first = int(inside.argmax())
            low, high = t[max(first - 1, 0)], t[first]
        at = 0.5 * float(low + high)
        for _ in range(4):
            value, gradient = self.field.first_order((origin + at * direction)[None])
            at = float(np.clip(at - float(value[0] / (gradient[0] @ direction)), low, high))
        return origin + at * direction

    def is_inside(self, point) -> bool:
        """Whether a point (3,) lies inside, where no probe can be."""
        return bool(self.value(np.asarray(point, float)[None])[0] < 0.0)

    def _near(self, origin, direction, length: float) -> tuple[float, float]:
        """The part of a segment from ``origin`` on, from and to a length, about the middle of the
        body: no longer than its diagonal."""
        middle, half = -float(origin @ direction), float(np.linalg.norm(self._half_extent))
        low, high = np.clip([middle - half, middle + half], 0.0, length)
        return float(low), float(high)

    def trace_arms(self, point, plane_normals, directions, reach, step, max_turn, step_turn=np.pi):
        """Curves from a surface point in several planes, all advanced step by step together.

        Parameters
        ----------
        point : (3,) float, length
        plane_normals, directions : (m, 3) float
            Plane and starting direction of each arm.
        reach, step : float, length
            Arc length of an arm, and that between its points.
        max_turn : float, rad
            Largest angle between the tangent and that at the start.
        step_turn : float, rad
            Turn from one point to the next beyond which there are others between them.

        Returns
        -------
        list of m pairs: points (k, 3) at arc lengths step, 2 step, ..., with those between, and a
        ContourEnd
        """
        return trace_arms(
            self.field, point, plane_normals, directions, reach, step, max_turn, step_turn
        )

    def mesh(self, sagitta: float) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (v, 3), (f, 3) with vertices on the surface.

        Where the radius of curvature is a tenth of the least extent, chords are off the surface by
        about ``sagitta``; elsewhere in proportion to the curvature. Of a body with plane faces the
        triangles are exact.
        """
        if self._triangles is not None:
            return self._triangles
        if sagitta not in self._meshes:
            edge = np.sqrt(8.0 * sagitta * 0.2 * self._half_extent.min())
            # Twice as many cells along a side take four times as long.
            edge = max(edge, 2.0 * self._half_extent.max() / 320)
            self._meshes[sagitta] = level_set_mesh(self.field, self._half_extent, edge)
        return self._meshes[sagitta]

    def sample(self, count: int, rng):
        """Area-uniform points (count, 3) exactly on the surface, and outward unit normals."""
        points, _ = sample_triangles(*self.mesh(0.5 * self.tolerance), count, rng)
        points = self.project(points)
        return points, self.normal(points)
