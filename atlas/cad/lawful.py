"""A lawful body as solids of the CAD kernel: one face for each face of the body, one for each
fillet, compared with the body."""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass

import igl
import numpy as np
import trimesh

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.cells import LawfulSolid, large_faces, make_circles, solids_inside
from touchatlas.atlas.cad.fillets import blunt_edges, fillet_radii, solid_edges, with_fillets
from touchatlas.atlas.cad.kernel import (
    NamedShape,
    NotWritten,
    is_valid,
    largest_tolerance,
    listed,
    points_along,
    refusals,
    triangles_of,
)
from touchatlas.atlas.cad.rims import Rim, made_tangent, smooth_rims
from touchatlas.atlas.cad.surfaces import LawSurface, law_surface
from touchatlas.patch.checks import check_above


@dataclass(frozen=True)
class LawfulOptions:
    """How far the solid of a lawful body may be from the body.

    Parameters
    ----------
    worst : float, tolerances
        Largest distance of the solid from the body, and of its fillets and blunt edges.
    unknown : float, from 0 to 1
        Largest part of the area of the solid that is unknown or farther from the body.
    outliers : float, from 0 to 1
        Largest part of the samples that are farther from the solid by more than noise.
    one_corner : float, tolerances
        Corners nearer than that are one, where otherwise some edge is shorter than a tolerance.
    circle : float, tolerances
        An ellipse whose half axes differ by less is a circle.
    """

    worst: float = 1.0
    unknown: float = 0.005
    outliers: float = 0.01
    one_corner: float = 0.25
    circle: float = 0.05

    def __post_init__(self) -> None:
        check_above(self)


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


def lawful_shapes(body: Body, tolerance: float, options: LawfulOptions) -> LawfulShapes:
    """Solids of a body.

    Parameters
    ----------
    body : Body
    tolerance : float, length
        Wanted accuracy of the surface.
    options : LawfulOptions

    Raises
    ------
    NotWritten
        A face or an edge could not be made, or the body is open, in words.
    """
    same, worst = body.field.same_surface, options.worst * tolerance
    surfaces = {k: _surface(body, k) for k in np.unique(same).tolist()}
    with refusals():
        solids = _solids(body, same, surfaces, tolerance, options)
        edges = [solid_edges(one) for one in solids]
    words, note = [face.words for face in body.faces.faces], ""
    shapes = [NamedShape(s.shape, s.faces, [words[k] for k in s.numbers]) for s in solids]
    try:
        with refusals():
            shapes = _rounded(body, same, shapes, edges, worst)
    except NotWritten as reason:
        note = _why_sharp(body, same, edges, reason, worst)
    _compare(body, shapes, tolerance, options)
    kinds = Counter(surfaces[k].kind for one in solids for k in one.numbers)
    gap = max(largest_tolerance(one.shape) for one in shapes)
    return LawfulShapes(shapes, kinds, gap, note)


def _surface(body: Body, number: int) -> LawSurface:
    face = body.faces.faces[number]
    found = law_surface(face, body.samples.points[face.samples])
    if found is None:
        raise NotWritten(f"face {number} is a {face.kind} face, which has no name in STEP")
    return found


def _solids(body: Body, same, surfaces, tolerance: float, options) -> list[LawfulSolid]:
    """The solids that surfaces bound: exact ones, or those with fewer corners where exact ones have
    edges shorter than a tolerance."""
    rims = smooth_rims(body.faces, same, surfaces)
    surfaces = made_tangent(surfaces, rims, body.extent)
    of = np.where(body.faces.of >= 0, same[body.faces.of], body.faces.of)
    samples = {k: _own_samples(body, of == k, k, surfaces, rims) for k in surfaces}
    large = large_faces(surfaces, rims, samples, body.extent)

    def distances(points):
        return body.field.at(points).distance

    solids, circle = solids_inside(large, distances, 0.0, body.extent), options.circle * tolerance
    if min(map(_shortest_edge, solids)) < tolerance:
        with suppress(NotWritten), refusals():
            fuzzy = options.one_corner * tolerance
            return _valid(solids_inside(large, distances, fuzzy, body.extent), circle)
    return _valid(solids, circle)


def _own_samples(body: Body, mine, number: int, surfaces, rims: list[Rim]) -> np.ndarray:
    """Those samples (m, 3) of a surface, ``mine`` (n,) bool, that tell it from all that it passes
    into at smooth rims, or all if none do: beside a rim labels are of either side."""
    points, std = body.samples.points[mine], body.samples.stds[mine]
    tells = np.ones(len(points), bool)
    for rim in rims:
        if number in (rim.first, rim.second):
            other = surfaces[rim.second if number == rim.first else rim.first]
            tells &= np.abs(other.at(points)[0]) > body.samples.levels.sure * std
    return points[tells] if tells.any() else points


def _valid(solids: list[LawfulSolid], circle: float) -> list[LawfulSolid]:
    """The solids with circles for edges, if the kernel finds nothing wrong with them."""
    for one in solids:
        make_circles(one.shape, circle)
    if not all(is_valid(one.shape) for one in solids):
        raise NotWritten("the CAD kernel finds the shape invalid")
    return solids


def _shortest_edge(one: LawfulSolid) -> float:
    """Length of the shortest edge of a solid."""
    steps = [np.diff(edge.points, axis=0) for edge in solid_edges(one) if len(edge.points)]
    return min(float(np.linalg.norm(s, axis=1).sum()) for s in steps)


def _rounded(body: Body, same, sharp: list[NamedShape], edges, worst: float) -> list[NamedShape]:
    """Shapes whose blunt edges are fillets; ``edges`` are those of each."""
    radii = (fillet_radii(body.faces, same, own, body.samples.levels.sure) for own in edges)
    shapes = [with_fillets(*one) for one in zip(sharp, edges, radii, strict=True)]
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


def _compare(body: Body, shapes: list[NamedShape], tolerance: float, options) -> None:
    """Compare shapes with what is known of the body, and samples of its faces with the shapes."""
    sagitta = 0.1 * tolerance
    worst = options.worst * tolerance + sagitta
    vertices, triangles = triangles_of([one.shape for one in shapes], sagitta)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    # Of 4,000 points the standard error of a part of 0.005 is 0.001.
    found, known = body.at(np.asarray(trimesh.sample.sample_surface(mesh, 4000, seed=0)[0]))
    unknown = float((~known | (np.abs(found.distance) > worst)).mean())
    if unknown > options.unknown:
        raise NotWritten(f"{unknown:.2%} of the surface of the solid is unknown or elsewhere")
    samples = body.samples.points[body.faces.of >= 0]
    square = igl.point_mesh_squared_distance(samples, vertices, triangles)[0]
    far = square > (worst + body.samples.levels.sure * body.samples.std) ** 2
    if far.mean() > options.outliers:
        raise NotWritten("the solid misses parts of the surface")
