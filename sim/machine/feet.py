"""Feet: the nearest point of a body's surface to the centre of a tip."""

import igl
import numpy as np
from scipy.spatial import cKDTree

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
        steps = 1
        if near is None:
            near, steps = self._guesses.data[self._guesses.query(centres)[1]], 12
        return self._newton(centres, near, steps)

    def distances(self, centres: np.ndarray) -> np.ndarray:
        """(n,) distances of centres (n, 3) from the surface, length, unsigned."""
        away = centres - self.of(centres)
        return np.asarray(np.sqrt((away * away).sum(axis=1)))

    def is_free(self, centre, radius: float) -> bool:
        """Whether a ball of a radius about a centre (3,) is outside of the body."""
        centre = np.asarray(centre, float)
        return self.distances(centre[None])[0] >= radius and not self._object.is_inside(centre)

    def _newton(self, centres, feet, steps: int) -> np.ndarray:
        """Feet on a level set: each step moves a guess in its tangent plane below the centre, and
        onto the surface. The error falls by the distance times the curvature in each."""
        assert isinstance(self._object, ImplicitObject)
        first_order = self._object.field.first_order
        for _ in range(steps):
            value, gradient = first_order(feet)
            square = (gradient * gradient).sum(axis=1)
            feet = feet - (value / square)[:, None] * gradient
            away = centres - feet
            feet = feet + away - ((away * gradient).sum(axis=1) / square)[:, None] * gradient
        value, gradient = first_order(feet)
        square = (gradient * gradient).sum(axis=1)
        found: np.ndarray = feet - (value / square)[:, None] * gradient
        return found
