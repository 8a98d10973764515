"""A lawful body as solids of the CAD kernel: one face for each face of the body, one for each
fillet, compared with the body."""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass

import igl
import numpy as np
import trimesh

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.lawful.fillets import blunt_edges, fillet_radii
from touchatlas.atlas.cad.lawful.law_surfaces import LawSurface, law_surface
from touchatlas.atlas.cad.lawful.occ_cells import LawfulSolid, solids_inside
from touchatlas.atlas.cad.lawful.occ_circles import make_circles
from touchatlas.atlas.cad.lawful.occ_fillets import solid_edges, with_fillets
from touchatlas.atlas.cad.lawful.occ_surfaces import large_faces
from touchatlas.atlas.cad.lawful.tangent_rims import made_tangent, smooth_rims
from touchatlas.atlas.cad.not_written import NoName, NotWritten
from touchatlas.atlas.cad.occ_kernel import NamedShape, refusals
from touchatlas.atlas.cad.occ_parts import (
    is_valid,
    largest_tolerance,
    listed,
    points_along,
    triangles_of,
)

# Distance up to which corners are one where exact ones leave edges shorter than a tolerance, in
# tolerances: where four faces meet within their errors there are two corners. Doubled, faces
# narrower than half a tolerance are lost.
_ONE_CORNER = 0.25
# Distance of an edge from its faces, in tolerances, up to which it is a circle: less than a
# measured face errs. Doubled, some more edges are circles.
_EXACT = 5e-2
# Largest distance of a shape from the body, in tolerances. Doubled, worse bodies are written by
# laws.
_WORST = 1.0
# The same of a sample, in standard deviations besides: noise exceeds it in one of 400. Doubled,
# parts that a solid misses by less than six of them are not seen.
_NOISE = 3.0
# Largest part of the area of a shape that is unknown or farther from the body, and of the samples
# that are farther from the shape: what explorations leave unknown by default, and wrong labels.
# Doubled, bodies with larger holes are written as solids.
_OPEN, _ASTRAY = 0.005, 0.01
# Distance of triangles from the shape while it is compared with the body, in tolerances. Doubled,
# distances are off by as much.
_SAGITTA = 0.1
# Points of a shape that are compared with the body. Doubled, parts half as large are found.
_COMPARED = 4000


@dataclass(frozen=True, eq=False)
class LawfulShapes:
    """Solids of the kernel.

    Parameters
    ----------
    shapes : list of NamedShape
    kinds : Counter
        Number of faces of each kind, without fillets.
    gap : float, length
        Largest distance of an edge or a vertex from its faces.
    note : str
        Why blunt edges were written as sharp ones; empty otherwise.
    """

    shapes: list[NamedShape]
    kinds: Counter[str]
    gap: float
    note: str = ""

    @property
    def fillets(self) -> int:
        """Number of faces that round edges and corners: those that no law names."""
        return sum(len(one.faces) for one in self.shapes) - self.kinds.total()


def lawful_shapes(body: Body, tolerance: float) -> LawfulShapes:
    """Solids of a body.

    Parameters
    ----------
    body : Body
    tolerance : float, length
        Wanted accuracy of the surface.

    Raises
    ------
    NotWritten
        A face or an edge could not be made, or the body is open, in words.
    """
    same = body.field.same_surface
    surfaces = {k: _surface(body, k) for k in np.unique(same).tolist()}
    with refusals():
        solids = _solids(body, same, surfaces, tolerance)
        edges = [solid_edges(one) for one in solids]
    words, note = [face.words for face in body.faces.faces], ""
    shapes = [NamedShape(s.shape, s.faces, [words[k] for k in s.numbers]) for s in solids]
    try:
        with refusals():
            shapes = _rounded(body, same, shapes, edges, _WORST * tolerance)
    except NotWritten as reason:
        note = _why_sharp(body, same, edges, reason, _WORST * tolerance)
    _compare(body, shapes, tolerance)
    kinds = Counter(surfaces[k].kind for one in solids for k in one.numbers)
    gap = max(largest_tolerance(one.shape) for one in shapes)
    return LawfulShapes(shapes, kinds, gap, note)


def _surface(body: Body, number: int) -> LawSurface:
    face = body.faces.faces[number]
    found = law_surface(face, body.samples.points[face.samples])
    if found is None:
        raise NoName(f"face {number} is a {face.kind} face, which has no name in STEP")
    return found


def _solids(body: Body, same, surfaces, tolerance: float) -> list[LawfulSolid]:
    """The solids that surfaces bound: exact ones, or those with fewer corners where exact ones have
    edges shorter than a tolerance."""
    rims = smooth_rims(body.faces, same, surfaces)
    surfaces = made_tangent(surfaces, rims, body.extent)
    of = np.where(body.faces.of >= 0, same[body.faces.of], body.faces.of)
    samples = {k: body.samples.points[of == k] for k in surfaces}
    large = large_faces(surfaces, rims, samples, body.extent)

    def distances(points):
        return body.field.at(points).distance

    solids, exact = solids_inside(large, distances, 0.0, body.extent), _EXACT * tolerance
    if min(map(_shortest_edge, solids)) < tolerance:
        with suppress(NotWritten), refusals():
            fuzzy = _ONE_CORNER * tolerance
            return _valid(solids_inside(large, distances, fuzzy, body.extent), exact)
    return _valid(solids, exact)


def _valid(solids: list[LawfulSolid], exact: float) -> list[LawfulSolid]:
    """The solids with circles for edges, if the kernel finds nothing wrong with them."""
    for one in solids:
        make_circles(one.shape, exact)
    if not all(is_valid(one.shape) for one in solids):
        raise NotWritten("the CAD kernel finds the shape invalid")
    return solids


def _shortest_edge(one: LawfulSolid) -> float:
    """Length of the shortest edge of a solid."""
    steps = [np.diff(edge.points, axis=0) for edge in solid_edges(one) if len(edge.points)]
    return min(float(np.linalg.norm(s, axis=1).sum()) for s in steps)


def _rounded(body: Body, same, sharp: list[NamedShape], edges, worst: float) -> list[NamedShape]:
    """Shapes whose blunt edges are fillets; ``edges`` are those of each."""
    pairs = zip(sharp, edges, strict=True)
    shapes = [with_fillets(one, own, fillet_radii(body.faces, same, own)) for one, own in pairs]
    new = zip(sharp, shapes, strict=True)
    fillets = [face for old, one in new for face in one.faces[len(old.faces) :]]
    rims = [
        np.concatenate([points_along(edge) for edge in listed(face, "Edge")]) for face in fillets
    ]
    # The median, because the field keeps the ends of some blunt edges sharp.
    off = max((float(np.median(_off(body, points))) for points in rims), default=0.0)
    if off > worst:
        raise NotWritten(f"a fillet misses the surface by {off:.3g}")
    return shapes


def _why_sharp(body: Body, same, edges, reason: NotWritten, worst: float) -> str:
    """Why blunt edges are written sharp, where that is within the tolerance."""
    blunt = [own[k].points for own in edges for k in blunt_edges(body.faces, same, own)]
    off = _off(body, np.concatenate(blunt)).max()
    if off > worst:
        raise reason
    return f"rounded edges are written sharp, off by {off:.3g}: {reason}"


def _off(body: Body, points) -> np.ndarray:
    """(k,) distance of points (k, 3) from the surface of a body."""
    return np.abs(body.field.at(points).distance)


def _compare(body: Body, shapes: list[NamedShape], tolerance: float) -> None:
    """Compare shapes with what is known of the body, and samples of its faces, which are off by
    noise besides, with the shapes."""
    sagitta, worst = _SAGITTA * tolerance, (_WORST + _SAGITTA) * tolerance
    vertices, triangles = triangles_of([one.shape for one in shapes], sagitta)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    found, known = body.at(np.asarray(trimesh.sample.sample_surface(mesh, _COMPARED, seed=0)[0]))
    open_part = float((~known | (np.abs(found.distance) > worst)).mean())
    if open_part > _OPEN:
        raise NotWritten(f"{open_part:.2%} of the surface of the solid is unknown or elsewhere")
    samples = body.samples.points[body.faces.of >= 0]
    square = igl.point_mesh_squared_distance(samples, vertices, triangles)[0]
    if (square > (worst + _NOISE * body.samples.std) ** 2).mean() > _ASTRAY:
        raise NotWritten("the solid misses parts of the surface")
