"""Surface: the triangles of an atlas, with normal and predicted deviation at each vertex."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import igl
import numpy as np

from touchatlas.patch.words import count_of, noun_of

if TYPE_CHECKING:
    from k3d.plot import Plot
    from trimesh import Trimesh

# Columns of a surface with a row for each vertex.
_OF_VERTICES = "vertices", "normals", "deviation", "patch", "gaussian_curvature"


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """The triangles of an atlas, with the values of the field at each vertex.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    normals : (v, 3) float, unit, world
    deviation : (v,) float, length
        Predicted standard deviation along the normal.
    patch : (v,) int
        Id of the face on which the vertex lies, among those of ``Atlas.body``: a patch in the sense
        of a part of the surface, and not the number of one polynomial.
    gaussian_curvature : (v,) float, 1/length^2
        Curvature of the faces, not of the triangles.
    stray_pieces : int
        Number of pieces beside the surface that were removed.
    closed_holes : (h, 3) float, length, world
        Middles of small holes that were closed across, without samples.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    patch: np.ndarray
    gaussian_curvature: np.ndarray
    stray_pieces: int = 0
    closed_holes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __repr__(self) -> str:
        """One line: arrays of all vertices would fill pages."""
        ends = len(igl.boundary_facets(self.faces)[0]) if len(self.faces) else 0
        triangles = noun_of(len(self.faces), "triangle")
        faces = count_of(len(np.unique(self.patch)), "face")
        words = f"{len(self.faces):,} {triangles} of {faces}"
        return f"<Surface: {words}, {'open' if ends or not len(self.faces) else 'closed'}>"

    def _repr_html_(self) -> str:
        """What is held, its size, and how sure it is."""
        line = f"<div>{repr(self)[1:-1]}</div>"
        if not len(self.vertices):
            return line
        size = " x ".join(f"{x:.4g}" for x in np.ptp(self.vertices, axis=0))
        half, most = np.quantile(self.deviation, [0.5, 0.95])
        rows = {"size": size, "deviation, median": f"{half:.3g}", "and 95 %": f"{most:.3g}"}
        cells = "".join(f"<tr><td>{name}</td><td>{words}</td></tr>" for name, words in rows.items())
        return f"{line}<table>{cells}</table>"

    def plot(self, colour: str = "deviation", unit: str = "") -> "Plot":
        """The surface in three dimensions, for a notebook, coloured by ``deviation`` or ``face``.

        Returns
        -------
        k3d.plot.Plot
        """
        from touchatlas.atlas.scene import add_surface, new_plot

        plot = new_plot(unit)
        add_surface(plot, self, colour)
        return plot

    def to_trimesh(self) -> "Trimesh":
        """The triangles as a ``trimesh.Trimesh`` with their normals, and ``deviation`` and
        ``patch`` among its ``vertex_attributes``."""
        from trimesh import Trimesh

        return Trimesh(
            self.vertices,
            self.faces,
            vertex_normals=self.normals,
            vertex_attributes={"deviation": self.deviation, "patch": self.patch},
            process=False,
        )

    def total_curvature(self) -> float:
        """Integral of the faces' Gaussian curvature over the triangles, no unit.

        On a closed surface it is 2 pi times the Euler characteristic, up to the error of the
        faces (Gauss-Bonnet; do Carmo, section 4-5). This check needs no truth.
        """
        areas = 0.5 * igl.doublearea(self.vertices, self.faces)
        return float(areas @ self.gaussian_curvature[self.faces].mean(axis=1))

    def only(self, known) -> "Surface":
        """The triangles whose vertices are all ``known`` (v,)."""
        return self.of(self.faces[known[self.faces].all(axis=1)])

    def of(self, faces) -> "Surface":
        """The manifold of any triangles (f, 3) between the vertices, and their vertices."""
        faces, index = manifold(faces)
        return self.taken(index, faces)

    def taken(self, index, faces) -> "Surface":
        """The vertices of indices (w,) with other triangles (f, 3) between them."""
        columns = {name: getattr(self, name)[index] for name in _OF_VERTICES}
        return replace(self, faces=faces, **columns)

    def extended(self, parts: "list[Surface]", faces, closed_holes) -> "Surface":
        """The surface with the vertices of others after its own, triangles (f, 3) between all, and
        holes (h, 3) that were closed besides."""
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in (self, *parts)])
            for name in _OF_VERTICES
        }
        holes = np.concatenate([self.closed_holes, closed_holes])
        return replace(self, faces=np.asarray(faces), closed_holes=holes, **columns)


def manifold(faces) -> tuple[np.ndarray, np.ndarray]:
    """The manifold of any triangles: no triangle names a vertex twice, an edge has two triangles of
    one orientation at most, and the triangles at a vertex are one fan.

    Triangles that name a vertex twice are left out. Of triangles of the same three vertices, those
    of opposed orientation enclose nothing and cancel, and one is left of those that do not. At
    edges of more triangles and at vertices of more fans the surface is cut: these vertices are
    doubled.

    Parameters
    ----------
    faces : (f, 3) int
        Vertices of triangles.

    Returns
    -------
    faces : (g, 3) int
        In the order of the first ones.
    index : (w,) int
        The old vertex of each new one, ascending. Vertices without triangles are left out.

    Examples
    --------
    Two triangles that touch in a vertex have a vertex each there:

    >>> faces, index = manifold([[0, 1, 2], [2, 3, 4], [1, 1, 4]])
    >>> faces.tolist(), index.tolist()
    ([[0, 1, 2], [3, 4, 5]], [0, 1, 2, 2, 3, 4])
    """
    faces = np.reshape(np.asarray(faces, np.int64), (-1, 3))
    one, two, three = faces.T
    # igl reads memory that was never set where a triangle names a vertex twice.
    faces = _once(faces[(one != two) & (two != three) & (three != one)])
    if not len(faces):
        return faces, np.zeros(0, np.int64)
    faces, index = igl.split_nonmanifold(faces)
    order = np.argsort(index, kind="stable")
    return np.argsort(order)[faces], np.asarray(index)[order]


def _once(faces) -> np.ndarray:
    """Triangles (g, 3), one of each three vertices, of those (f, 3) that do not cancel."""
    one, two, three = faces.T
    side = 2 * ((one < two).astype(int) + (two < three) + (three < one)) - 3
    corners = np.sort(faces)
    order = np.lexsort(corners.T)
    group = np.zeros(len(faces), int)
    group[order] = np.cumsum((np.diff(corners[order], axis=0, prepend=-1) != 0).any(axis=1)) - 1
    left = np.flatnonzero(side * np.bincount(group, side)[group] > 0.0)
    return np.asarray(faces[np.sort(left[np.unique(group[left], return_index=True)[1]])])
