"""An object given by an implicit function: exact normals, curvatures, contours, contacts."""

from functools import cached_property

import numpy as np

from touchatlas.patch import ContourEnd
from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.world.finer_steps import finer_steps
from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.level_set import level_set_mesh, newton_projection
from touchatlas.sim.world.triangles import areas_of, sample_triangles, top_sample

# A normal that turns by more than this angle, in rad, within 1/256 of a step turns at an edge.
# At twice the angle a curve cuts the corners of blunt edges off.
_EDGE_TURN = np.deg2rad(15.0)
# Longest step, in arc lengths. A chord is never longer than its arc; but beyond an edge a face may
# be nearly perpendicular to the plane of the curve, and Newton's method ends anywhere on it. With
# twice as much some of these steps would pass for steps on the same face.
_LONGEST_CHORD = 1.5
# Shortest step before an edge, in steps. Doubled, a curve cuts corners off that are twice as large.
_ACROSS = 1.0 / 256.0
# Least turn of a contour with which a probe runs over edges, rad: a right angle, that of most.
# Contours that may turn by less end there. Doubled, none runs over an edge.
_OVER_EDGES = 0.5 * np.pi
# Most cells along the longest side of the grid: twice as many take four times as long.
_GRID_LIMIT = 320
# Rounding of a cosine; twice as much changes nothing.
_ROUNDING = 1e-12


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
        gradient = self.field.first_order(points)[1]
        return gradient / np.sqrt((gradient**2).sum(axis=1))[:, None]

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
        """First point where a segment enters the body, (3,), or None."""
        low, high = 0.0, length
        for _ in range(3):
            t = np.linspace(low, high, 65)
            inside = self.value(origin + t[:, None] * direction) < 0.0
            if inside[0] and low == 0.0:
                return None
            if not inside.any():
                return None
            first = int(inside.argmax())
            low, high = t[max(first - 1, 0)], t[first]
        at = 0.5 * float(low + high)
        for _ in range(4):
            value, gradient = self.field.first_order((origin + at * direction)[None])
            at = float(np.clip(at - float(value[0] / (gradient[0] @ direction)), low, high))
        return origin + at * direction

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
        normals = np.array(plane_normals)
        first = self._tangents(np.broadcast_to(point, normals.shape), normals)
        normals = np.where(((first * directions).sum(axis=1) < 0.0)[:, None], -normals, normals)
        first = self._tangents(np.broadcast_to(point, normals.shape), normals)
        x, paths = np.broadcast_to(point, normals.shape).copy(), []
        ends = [ContourEnd.LENGTH_REACHED] * len(normals)
        counts = np.zeros(len(normals), int)
        active = np.ones(len(normals), bool)
        for number in range(int(reach / step + 1e-9)):
            ahead = x.copy()
            ahead[active] = self._step(x[active], normals[active], step)
            tangents = self._tangents(ahead, normals)
            cosine = (tangents * first).sum(axis=1)
            offset = ahead - point
            home = (number > 2) & ((offset * offset).sum(axis=1) < (0.5 * step) ** 2)
            for arm in np.flatnonzero(
                active & ((cosine < np.cos(min(max_turn, np.pi)) - _ROUNDING) | home)
            ):
                active[arm] = False
                ends[arm] = (
                    ContourEnd.CLOSED_LOOP
                    if home[arm]
                    else self._end_ahead(x[arm], normals[arm], step, max_turn)
                )
            counts += active
            x = np.where(active[:, None], ahead, x)
            paths.append(x)
            if not active.any():
                break
        path = np.array(paths).reshape(len(paths), len(normals), 3)
        arms = [path[: counts[arm], arm] for arm in range(len(normals))]
        return [
            (self._finer(point, arm, normal, step, step_turn), end)
            for arm, normal, end in zip(arms, normals, ends, strict=True)
        ]

    def _finer(self, point, arm, normal, step, step_turn) -> np.ndarray:
        """An arm (k, 3) with the points between those that it turns much."""
        arm = np.vstack([point[None], arm])

        def between(at) -> np.ndarray:
            whole = at.astype(int)
            planes = np.broadcast_to(normal, (len(at), 3))
            return self._advance(arm[whole], planes, step * (at - whole)[:, None])

        at = finer_steps(arm, step_turn, between)[1:]
        whole = at == np.round(at)
        points = np.empty((len(at), 3))
        points[whole], points[~whole] = arm[1:], between(at[~whole])
        return points

    def _step(self, x, normals, step) -> np.ndarray:
        """(m, 3) points one step of arc length from points x (m, 3) along each curve, also over
        edges."""
        ahead = self._advance(x, normals, step)
        breaks = _breaks(x, ahead, self.normal(x), self.normal(ahead), step)
        for arm in np.flatnonzero(breaks):
            ahead[arm] = self._step_over_edges(x[[arm]], normals[[arm]], step)
        return ahead

    def _step_over_edges(self, x, normal, step) -> np.ndarray:
        """(3,) point one step of arc length from x (1, 3) along a curve: up to each edge in shorter
        and shorter steps, and across it in two of the shortest."""
        # An edge is known to lie within ``most`` ahead: longer steps need not be tried.
        left, shortest, most = step, _ACROSS * step, np.inf
        while left > shortest:
            way = left
            while way > max(most, shortest):
                way *= 0.5
            ahead = self._advance(x, normal, way)
            while _breaks(x, ahead, self.normal(x), self.normal(ahead), way)[0]:
                if way <= shortest:
                    way, most = 2.0 * shortest, np.inf
                    ahead = self._advance(x, normal, way)
                    break
                most, way = way, 0.5 * way
                ahead = self._advance(x, normal, way)
            x, left, most = ahead, left - way, most - way
        return np.asarray(x[0])

    def _end_ahead(self, x, normal, step, max_turn) -> ContourEnd:
        """EDGE where the tangent ahead of x turns too much at a point, TURNED_AWAY where it turns
        too much in all, or may turn by a right angle."""
        if max_turn >= _OVER_EDGES:
            return ContourEnd.TURNED_AWAY
        x, normal = x[None], normal[None]
        for _ in range(8):
            step *= 0.5
            ahead = self._advance(x, normal, step)
            if not _breaks(x, ahead, self.normal(x), self.normal(ahead), step)[0]:
                x = ahead
        ahead = self._advance(x, normal, 2.0 * step)
        breaks = _breaks(x, ahead, self.normal(x), self.normal(ahead), 2.0 * step)[0]
        cosine = float(self._tangents(x, normal)[0] @ self._tangents(ahead, normal)[0])
        jumps = breaks and cosine < np.cos(max_turn)
        return ContourEnd.EDGE if jumps else ContourEnd.TURNED_AWAY

    def _tangents(self, x, normals) -> np.ndarray:
        """Unit tangents (m, 3) of the curve through each x in each plane."""
        tangents = cross(self.field.first_order(x)[1], normals)
        return tangents / np.sqrt((tangents**2).sum(axis=1))[:, None]

    def _advance(self, x, normals, step) -> np.ndarray:
        """One step of arc length, or one of each of (m, 1), along each curve: Runge-Kutta, then
        Newton in the plane."""
        a = self._tangents(x, normals)
        b = self._tangents(x + 0.5 * step * a, normals)
        c = self._tangents(x + 0.5 * step * b, normals)
        d = self._tangents(x + step * c, normals)
        ahead = x + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        for _ in range(3):
            value, gradient = self.field.first_order(ahead)
            gradient = gradient - (gradient * normals).sum(axis=1)[:, None] * normals
            square = np.maximum((gradient**2).sum(axis=1), np.finfo(float).tiny)
            ahead = ahead - (value / square)[:, None] * gradient
        return ahead

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
            edge = max(edge, 2.0 * self._half_extent.max() / _GRID_LIMIT)
            self._meshes[sagitta] = level_set_mesh(self.field, self._half_extent, edge)
        return self._meshes[sagitta]

    def sample(self, count: int, rng):
        """Area-uniform points (count, 3) exactly on the surface, and outward unit normals."""
        points, _ = sample_triangles(*self.mesh(0.5 * self.tolerance), count, rng)
        points = self.project(points)
        return points, self.normal(points)


def _breaks(x, ahead, before, after, step: float) -> np.ndarray:
    """(m,) whether steps from points x (m, 3) with normals ``before`` left their smooth face: the
    normal turned at an edge, or the step is too long."""
    turned = (before * after).sum(axis=1) < np.cos(_EDGE_TURN)
    chord = ahead - x
    return turned | ((chord * chord).sum(axis=1) > (_LONGEST_CHORD * step) ** 2)
