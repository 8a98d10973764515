"""A lawful body as shapes of the CAD kernel: one face for each face of the body, checked, and one
for each fillet."""

from dataclasses import dataclass, replace

import igl
import numpy as np

from touchatlas.atlas.cad.brep import Brep
from touchatlas.atlas.cad.face_layout import FaceLayout, NoName, NotWritten, cut_seams
from touchatlas.atlas.cad.fillets import blunt_edges, fillet_radii, points_along
from touchatlas.atlas.cad.lawful_brep import brep_of
from touchatlas.atlas.cad.occ_faces import areas, face_shapes, is_valid
from touchatlas.atlas.cad.occ_fillets import (
    edge_points,
    largest_tolerance,
    with_fillets,
)
from touchatlas.atlas.cad.occ_kernel import NamedShape, refusals
from touchatlas.atlas.cad.place_faces import place_faces
from touchatlas.atlas.faces.body import Body
from touchatlas.atlas.mesh.body_surface import body_surface, coarse_edge, fine_edge

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
    """Shapes of the kernel, one a part.

    Parameters
    ----------
    brep : Brep
        The numbers that they were made from, with sharp edges.
    shapes : list of NamedShape
    left_out : int
        Number of small stray parts that were left out.
    gap : float, length
        Largest distance of an edge or a vertex from its faces.
    note : str
        Why blunt edges were written as sharp ones; empty otherwise.
    """

    brep: Brep
    shapes: list[NamedShape]
    left_out: int
    gap: float
    note: str = ""

    @property
    def fillets(self) -> int:
        """Number of faces that round edges and corners: those that no law names."""
        return sum(len(one.faces) for one in self.shapes) - len(self.brep.faces)

    def count(self, kind: str) -> int:
        """Number of faces of a kind."""
        return sum(face.surface.kind == kind for face in self.brep.faces)


def lawful_shapes(body: Body, tolerance: float, sagitta: float) -> LawfulShapes:
    """Shapes of a body, by the first triangles from which they are valid.

    Parameters
    ----------
    body : Body
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
    reasons, sharp = [], []
    for edge in tried:
        try:
            made = _shapes(body, tolerance, edge)
        except NoName:
            raise
        except NotWritten as reason:
            reasons.append(reason)
            continue
        try:
            return _rounded(made, body, tolerance)
        except NotWritten as reason:
            sharp.append((made, reason))
    if not sharp:
        raise reasons[0]
    return _sharp(*sharp[0], body, tolerance)


def _rounded(made: LawfulShapes, body: Body, tolerance: float) -> LawfulShapes:
    """Shapes whose blunt edges are fillets."""
    radii = fillet_radii(body.faces, made.brep)
    if not radii:
        return made
    with refusals():
        shapes = [with_fillets(one, radii) for one in made.shapes]
        gap = max(made.gap, *(largest_tolerance(one.shape) for one in shapes))
        new = zip(made.shapes, shapes, strict=True)
        fillets = [face for old, one in new for face in one.faces[len(old.faces) :]]
        # The median, because the field keeps the ends of some blunt edges sharp.
        off = [np.median(_off(body, edge_points(face))) for face in fillets]
    worst = max([gap, *off])
    if worst > _WORST * tolerance:
        raise NotWritten(f"a fillet misses the surface by {worst:.3g}")
    return replace(made, shapes=shapes, gap=gap)


def _sharp(made: LawfulShapes, reason: NotWritten, body: Body, tolerance: float) -> LawfulShapes:
    """Shapes whose blunt edges stay sharp for a reason, where that is within the tolerance."""
    blunt = [points_along(made.brep.edges[k]) for k in blunt_edges(body.faces, made.brep)]
    off = _off(body, np.concatenate(blunt)).max()
    if off > _WORST * tolerance:
        raise reason
    return replace(made, note=f"rounded edges are written sharp, off by {off:.3g}: {reason}")


def _off(body: Body, points) -> np.ndarray:
    """(k,) distance of points (k, 3) from the surface of a body."""
    return np.abs(body.field.at(points).distance)


def _shapes(body: Body, tolerance: float, edge: float) -> LawfulShapes:
    """Shapes of a body by its triangles in cubes of an edge, length."""
    drawn = body_surface(body, edge)
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
    with refusals():
        gap = float(brep.gaps.max())
        made = LawfulShapes(brep, face_shapes(brep, names), placed.left_out, gap)
        if made.gap > _WORST * tolerance:
            raise NotWritten(f"an edge misses its faces by {made.gap:.3g}")
        wanted = 0.5 * igl.doublearea(drawn.vertices, drawn.faces)
        wanted = np.bincount(regions.of, wanted) + _beyond_rounding(body, made.brep)
        _check_areas(made, wanted, layout, edge)
        if not all(is_valid(one.shape) for one in made.shapes):
            raise NotWritten("the CAD kernel finds the shape invalid")
    return made


def _beyond_rounding(body: Body, brep: Brep) -> np.ndarray:
    """(f,) area by which each face of a Brep is larger than half of the roundings of its edges."""
    out = np.zeros(len(brep.faces))
    for number, place in blunt_edges(body.faces, brep).items():
        edge, half = body.faces.edges[place], 0.5 * body.faces.edges[place].angle
        steps = np.diff(points_along(brep.edges[number]), axis=0)
        more = edge.radius * (np.tan(half) - half) * np.linalg.norm(steps, axis=1).sum()
        out[sorted(brep.beside[number])] += more
    return out


def _check_areas(made: LawfulShapes, wanted, layout: FaceLayout, edge: float) -> None:
    """Compare the areas of faces with those ``wanted`` (f,): bounds around the wrong part enclose
    another area."""
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
