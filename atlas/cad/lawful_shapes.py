"""A lawful body as shapes of the CAD kernel: one face for each face of the body, checked."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.atlas.cad.face_layout import FaceLayout, NoName, NotWritten, cut_seams
from touchatlas.atlas.cad.face_regions import Regions
from touchatlas.atlas.cad.lawful_brep import Brep, brep_of
from touchatlas.atlas.cad.occ_faces import areas, face_shapes, is_valid
from touchatlas.atlas.cad.occ_kernel import NamedShape
from touchatlas.atlas.cad.place_faces import place_faces
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.lawful_surface import coarse_edge, fine_edge, lawful_surface
from touchatlas.atlas.mesh.surface import Surface

# Distance of an edge from its faces, in tolerances, up to which it is a straight line or an arc:
# less than a measured face errs. The axis of a cone leans by its error, so that its rim is no
# circle. Doubled, some more edges are arcs.
_EXACT = 5e-2
# Edges of the triangles that are tried after the fine ones, over the coarse ones: where little was
# touched some triangles run on beyond edges, and others do not. Doubled, narrow faces are missed.
_TRIED = (1.0, 0.8, 1.6)
# Largest error of an edge, in tolerances. Doubled, bodies with worse edges are written by laws.
_WORST = 1.0
# Largest difference of the area of a face from that of its triangles: relative, and along its
# bounds in edges of the triangles. Doubled, a face with a part too much may pass.
_AREA, _BOUND = 0.02, 1.0


@dataclass(frozen=True, eq=False)
class LawfulShapes:
    """Shapes of the kernel, one a part, the numbers that they were made from, and the number of
    small stray parts that were left out."""

    brep: Brep
    shapes: list[NamedShape]
    left_out: int

    @property
    def gap(self) -> float:
        """Largest distance of an edge or a vertex from its faces, length."""
        return float(self.brep.gaps.max())

    def count(self, kind: str) -> int:
        """Number of faces of a kind."""
        return sum(face.surface.kind == kind for face in self.brep.faces)


def lawful_shapes(body: LawfulBody, tolerance: float, sagitta: float) -> LawfulShapes:
    """Shapes of a body, by the first triangles from which they are valid.

    Parameters
    ----------
    body : LawfulBody
    tolerance : float, length
        Wanted accuracy of the surface.
    sagitta : float, length
        Of the triangles that show where faces end.

    Raises
    ------
    NotWritten
        A face or an edge could not be made, in words.
    """
    tried = [fine_edge(body, sagitta), *(times * coarse_edge(body) for times in _TRIED)]
    reasons = []
    for edge in tried:
        try:
            return _shapes(body, tolerance, edge)
        except NoName:
            raise
        except NotWritten as reason:
            reasons.append(reason)
    raise reasons[0]


def _shapes(body: LawfulBody, tolerance: float, edge: float) -> LawfulShapes:
    """Shapes of a body by its triangles in cubes of an edge, length."""
    drawn = lawful_surface(body, edge)
    if not len(drawn.faces):
        raise NotWritten("nothing of the surface is known")
    placed = place_faces(body, drawn, edge)
    layout, regions, drawn = placed.layout, placed.regions, placed.drawn
    inner = [
        drawn.vertices[np.unique(drawn.faces[regions.of == r])] for r in range(len(regions.labels))
    ]
    cut_seams(layout, inner)
    brep = brep_of(layout, regions.labels, _EXACT * tolerance)
    names = {face.id: face.words for face in body.faces.faces}
    with _refusals():
        made = LawfulShapes(brep, face_shapes(brep, names), placed.left_out)
        if made.gap > _WORST * tolerance:
            raise NotWritten(f"an edge misses its faces by {made.gap:.3g}")
        _check_areas(made, drawn, layout, regions, edge)
        if not all(is_valid(one.shape) for one in made.shapes):
            raise NotWritten("the CAD kernel finds the shape invalid")
    return made


@contextmanager
def _refusals() -> Iterator[None]:
    """Let what the kernel refuses be a reason why faces are not written."""
    from OCP.Standard import Standard_Failure

    try:
        yield
    except Standard_Failure as error:
        raise NotWritten(f"the CAD kernel refuses a face: {error}") from None


def _check_areas(
    made: LawfulShapes, drawn: Surface, layout: FaceLayout, regions: Regions, edge: float
) -> None:
    """Compare the faces with their triangles: bounds around the wrong part enclose another area."""
    wanted = np.bincount(regions.of, 0.5 * igl.doublearea(drawn.vertices, drawn.faces))
    around = np.zeros(len(wanted))
    for region, loops in enumerate(layout.loops):
        for loop in loops:
            steps = np.diff(layout.loop_points(loop), axis=0)
            around[region] += np.linalg.norm(steps, axis=1).sum()
    allowed = _AREA * wanted + _BOUND * edge * around
    for one, part in zip(made.shapes, made.brep.parts, strict=True):
        rows = list(part)
        if (np.abs(areas(one.faces) - wanted[rows]) > allowed[rows]).any():
            raise NotWritten("a face has not the area of its triangles")
