"""Feet: the nearest point of a body's surface to the centre of a tip."""

import igl
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject


class Feet:
    """Nearest points of the surface of an object.

    Parameters
    ----------
    obj : ImplicitObject or MeshObject
    """

    def __init__(self, obj: ImplicitObject | MeshObject) -> None:
        self._object = obj
        vertices, faces = obj.mesh(0.5 * obj.tolerance)
        # Triangles are the surface itself of a mesh, and of a body with plane faces.
        exact = isinstance(obj, MeshObject) or obj.has_plane_faces
        self._tree = igl.AABB() if exact else None
        if self._tree is not None:
            self._vertices, self._faces = (
                np.ascontiguousarray(vertices),
                np.ascontiguousarray(faces),
            )
            self._tree.init(self._vertices, self._faces)
        else:
            self._guesses = cKDTree(vertices)

    def of(self, centres: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) feet of centres (n, 3), length.

        Parameters
        ----------
        centres : (n, 3) float, length
        near : (n, 3) float, length, optional
            Feet of centres nearby, which spare a search.
        """
        if self._tree is not None:
            found = self._tree.squared_distance(
                self._vertices, self._faces, np.ascontiguousarray(centres)
            )
            return np.reshape(found[2], (-1, 3))
        if near is None:
            guesses = self._on_surface(self._guesses.data[self._guesses.query(centres)[1]])
            return self._sought(centres, guesses, 16)
        # In contact one step is enough, unless the ball is larger than the surface is curved.
        return self._sought(centres, near, 6, once=True)

    def distances(self, centres: np.ndarray) -> np.ndarray:
        """(n,) distances of centres (n, 3) from the surface, length, unsigned."""
        away = centres - self.of(centres)
        return np.asarray(np.sqrt((away * away).sum(axis=1)))

    def normals(self, feet: np.ndarray) -> np.ndarray:
        """(n, 3) outward unit normals at points of the surface (n, 3)."""
        if self._tree is None:
            assert isinstance(self._object, ImplicitObject)
            return self._object.normal(feet)
        found = self._tree.squared_distance(self._vertices, self._faces, feet)
        a, b, c = self._vertices[self._faces[np.ravel(found[1])]].transpose(1, 0, 2)
        normals = cross(b - a, c - a)
        return np.asarray(normals / np.sqrt((normals * normals).sum(axis=1))[:, None])

    def is_free(self, centre, radius: float) -> bool:
        """Whether a ball of a radius about a centre (3,) is outside of the body."""
        centre = np.asarray(centre, float)
        return self.distances(centre[None])[0] >= radius and not self._object.is_inside(centre)

    def free_length(self, start, end, radius: float) -> float:
        """How far a ball of a radius goes straight from ``start`` (3,) toward ``end`` (3,) before
        it meets the body, length; infinite where it does not.

        Each step goes as far as the nearest surface is away, and farther where the ball moves away
        from it (Hart, Sphere tracing, The Visual Computer 12, 1996).
        """
        start, way = np.asarray(start, float), np.asarray(end, float) - np.asarray(start, float)
        length = float(np.linalg.norm(way))
        direction, gone = way / max(length, 1e-300), 0.0
        while gone < length:
            centre = start + gone * direction
            away = centre - self.of(centre[None])[0]
            gap = float(np.sqrt(away @ away)) - radius
            if away @ direction >= 0.0:
                gap = max(gap, 0.1 * radius)
            elif gap < 1e-5 * radius:
                return gone
            gone += gap
        return np.inf

    def _sought(self, centres, feet, most: int, once: bool = False) -> np.ndarray:
        """Feet (n, 3) of centres from places (n, 3) on the surface, by so many steps along it at
        most, or until all have come nearer ``once``. A whole step goes too far where the distance
        is more than the radius of curvature, so steps that lead away are halved."""
        share, least = np.ones(len(centres)), ((centres - feet) ** 2).sum(axis=1)
        for _ in range(most):
            tried = self._on_surface(feet + share[:, None] * self._aside(centres, feet))
            square = ((centres - tried) ** 2).sum(axis=1)
            # A foot that is found stays, up to rounding.
            nearer = square <= (1.0 + 1e-12) * least
            feet = np.where(nearer[:, None], tried, feet)
            least = np.minimum(square, least)
            if once and nearer.all():
                break
            share = np.where(nearer, np.minimum(1.0, 1.5 * share), 0.5 * share)
        return feet

    def _aside(self, centres, feet) -> np.ndarray:
        """(n, 3) parts of the ways from feet to centres within the tangent planes."""
        gradient = self._first_order(feet)[1]
        away = centres - feet
        share = (away * gradient).sum(axis=1) / (gradient * gradient).sum(axis=1)
        found: np.ndarray = away - share[:, None] * gradient
        return found

    def _on_surface(self, points) -> np.ndarray:
        """(n, 3) points moved onto the surface by two steps of Newton's method."""
        for _ in range(2):
            value, gradient = self._first_order(points)
            points = points - (value / (gradient * gradient).sum(axis=1))[:, None] * gradient
        return np.asarray(points)

    def _first_order(self, points) -> tuple[np.ndarray, np.ndarray]:
        """f (n,) and its gradient (n, 3) at points (n, 3)."""
        assert isinstance(self._object, ImplicitObject)
        return self._object.field.first_order(points)
