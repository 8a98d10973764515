"""The surface of an atlas: its body drawn as triangles, refined, and mended where no law holds.

A body is drawn in coarse cubes that show its shape, and edges of triangles are halved where they
are too far from it. Between samples a free-form face may have zeros beside the surface, small holes
and small handles. Faces that obey laws have no small handles.
"""

from dataclasses import replace

import igl
import numpy as np

from touchatlas.atlas.body.body import HEIGHT, Body
from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.mesh.contour import dual_contour
from touchatlas.atlas.mesh.handles import without_small_handles
from touchatlas.atlas.mesh.mend import LARGEST, close_holes, ended_at_rims, without_stray_pieces
from touchatlas.atlas.mesh.refine import edges_of, refined
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.predictive_law import deviation_with_misses
from touchatlas.atlas.state import AtlasState
from touchatlas.atlas.surfaces.fewer import fewer_sextics
from touchatlas.patch.geometry.arrays import real
from touchatlas.patch.geometry.normal_error import SURE

# Cubes along the extent of a body: with the first number its shape is drawn for planning, the
# second is the most, because time and memory grow with its square.
_COARSE, MOST = 32, 160
# Largest edge of a cube over the thinnest wall, so that each side has its own cubes.
_WALL = 0.4
# Largest edge of a cube over the reach of samples: no diagonal, rounded down, is longer than the
# height up to which ``Body.at`` finds the feet of corners.
WITHIN_REACH = int(100.0 * HEIGHT / 3.0**0.5) / 100.0


def coarse_edge(body: Body) -> float:
    """Edge of the cubes that show the shape of a body, length."""
    # Thinner walls are differences of samples by chance.
    wall = max(body.thickness, 4.0 * body.samples.std)
    edge = min(body.extent / _COARSE, _WALL * wall, WITHIN_REACH * body.reach)
    return max(edge, body.extent / MOST)


def shape_edge(body: Body) -> float:
    """Edge of the cubes in which triangles of a body are drawn before they are refined, length: a
    narrow bend passes some of them. Roundings of edges are cut off, and refined."""
    bend = 0.5 / max(_curvature(body), np.finfo(float).tiny)
    return max(min(coarse_edge(body), bend), body.extent / MOST)


def fine_edge(body: Body, sagitta: float) -> float:
    """Edge of the cubes whose triangles are within ``sagitta`` (length) of the faces: the sagitta
    of a chord c on a circle of radius r is c^2 / 8 r, and a chord is a diagonal of two edges. Such
    cubes show small holes of a body with edges. Roundings of edges do not count.
    """
    # Planes alone bend by rounding at most; with zero the quotient overflows.
    bend = np.sqrt(4.0 * sagitta / max(_curvature(body), np.finfo(float).eps / body.extent))
    return max(min(coarse_edge(body), float(bend)), body.extent / MOST)


def _curvature(body: Body) -> float:
    """Largest curvature of the faces of a body with edges, 1/length."""
    return 0.0 if body.is_one_face else body.largest_curvature


def body_surface(body: Body, edge: float) -> Surface:
    """The surface of a body in cubes of an edge, length. Its ``patch`` is the id of the face, and
    its curvatures are zero: see ``with_curvatures``.

    It is closed where the surface is known everywhere, and ends where it is not.
    """

    def at_corners(points):
        found, known, unsure = body.among(points)
        return found.distance, found.normal, known, unsure

    vertices, faces = dual_contour(
        body.field.level, at_corners, body.seeds, edge, not body.is_one_face, body.is_sure
    )
    found = body.field.at(vertices)
    vertices = vertices - np.clip(found.distance, -edge, edge)[:, None] * found.normal
    # A face whose equation fails at a vertex says nothing of it: it may lie anywhere.
    deviation = np.minimum(found.deviation, body.extent)
    return Surface(vertices, faces, found.normal, deviation, found.face, np.zeros(len(vertices)))


def _with_unknown_risers(body: Body, surface: Surface) -> Surface:
    """A surface whose deviation is at least half of the height between two levels, at the ends of
    edges of triangles that lead from one face to a parallel one without an edge in common: the
    surface may go over from one to the other anywhere between their samples."""
    ends = edges_of(surface.faces)[0]
    of, normals = surface.patch[ends], surface.normals[ends]
    across = ~body.field.meet[of[:, 0], of[:, 1]]
    across &= (normals[:, 0] * normals[:, 1]).sum(axis=1) > 0.95
    ends, of = ends[across], of[across]
    height = np.full(len(ends), np.inf)
    for own, other in ((0, 1), (1, 0)):
        for face in np.unique(of[:, own]).tolist():
            mine = of[:, own] == face
            off = body.field.trees.of(face).distances(surface.vertices[ends[mine, other]])
            height[mine] = np.minimum(height[mine], np.abs(off))
    deviation = surface.deviation.copy()
    np.maximum.at(deviation, ends.ravel(), np.repeat(0.5 * height, 2))
    return replace(surface, deviation=deviation)


def _with_misses(state: AtlasState, body: Body, surface: Surface) -> Surface:
    """A surface whose deviation holds where a face may end unseen, see ``deviation_with_misses``,
    if it is open beside the rims at which contact was lost: where all faces meet, each ends where
    the next begins."""
    ends = igl.boundary_facets(surface.faces)[0]
    middles = surface.vertices[ends].mean(axis=1)
    if not len(ends) or state.rims.at(middles, state.tolerance).all():
        return surface
    away = body.away(surface.vertices)
    deviation = deviation_with_misses(surface.deviation, away, state.innovations)
    return replace(surface, deviation=deviation)


def with_curvatures(body: Body, surface: Surface) -> Surface:
    """A surface with the Gaussian curvature of the body at its vertices; where that jumps at rims,
    the mean about each vertex."""
    vertices, faces = surface.vertices, surface.faces
    if body.is_one_face:
        curvature = body.gaussian_curvature(vertices, surface.patch)
    else:
        # At vertices a tenth of that of a plate was missing.
        found = body.field.at(vertices[faces].mean(axis=1))
        weights = _inner_weights(4)
        points = (weights @ vertices[faces]).reshape(-1, 3)
        inside = body.gaussian_curvature(points, np.repeat(found.face, len(weights)))
        # A triangle stands for the part of the surface that it is seen against along its normals.
        cosine = (igl.per_face_normals(vertices, faces, np.zeros(3)) * found.normal).sum(axis=1)
        means = np.maximum(cosine, 0.0) * inside.reshape(-1, len(weights)).mean(axis=1)
        curvature = _means_about_vertices(vertices, faces, means)
    return replace(surface, gaussian_curvature=curvature)


def _inner_weights(parts: int) -> np.ndarray:
    """(parts^2, 3) weights of the corners of a triangle in the middles of equal smaller ones.

    >>> _inner_weights(2).round(2).tolist()
    [[0.17, 0.17, 0.67], [0.17, 0.67, 0.17], [0.33, 0.33, 0.33], [0.67, 0.17, 0.17]]
    """
    upright = [(i + 1 / 3, j + 1 / 3) for i in range(parts) for j in range(parts - i)]
    turned = [(i + 2 / 3, j + 2 / 3) for i in range(parts) for j in range(parts - i - 1)]
    first, second = np.array(sorted(upright + turned)).T / parts
    return np.column_stack([first, second, 1.0 - first - second])


def _means_about_vertices(vertices, faces, values) -> np.ndarray:
    """(v,) means of the values of triangles (f,) about each vertex, each with the weight of its
    area: their integral over all triangles is the same."""
    area, corners = np.repeat(igl.doublearea(vertices, faces), 3), faces.ravel()
    total = np.bincount(corners, area, len(vertices))
    sums = np.bincount(corners, area * np.repeat(values, 3), len(vertices))
    return np.asarray(sums / np.maximum(total, np.finfo(float).tiny))


def extract_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """The surface of the atlas's body as triangles: a manifold.

    Small holes and slits are closed, and pieces that no sample supports left out; where not all
    faces obey laws, small pieces and handles as well.

    Parameters
    ----------
    state : AtlasState
    edge : float, length, optional
        Edge of the cubes in which triangles are drawn, which are about as large everywhere. Without
        it they are as large as ``AtlasOptions.facets`` allows.

    Raises
    ------
    ValueError
        When the argument is no Atlas, or has no body, or the edge is no length, longer than the
        body, or too short for the memory.
    """
    _body_of(state)
    state = state.without_tip
    body, sagitta = _body_of(state), state.options.facets * state.tolerance
    drawn = _drawn(body, sagitta) if edge is None else body_surface(body, _checked(body, edge))
    lawful = body.faces.are_lawful and not body.is_one_face
    # What was touched of a lawful body is no leaf, however small.
    surface = without_stray_pieces(drawn, body.samples.points, 0.0 if lawful else LARGEST)
    if edge is None:
        surface = refined(body, surface, sagitta)
    surface = with_curvatures(body, surface)
    surface = replace(surface, deviation=state.law.deviations(surface.deviation))
    if not lawful:
        surface = ended_at_rims(surface, body)
    if not body.is_one_face:
        surface = _with_unknown_risers(body, surface)
        surface = _with_misses(state, body, surface)
    surface = close_holes(surface, state.rims)
    unsure = SURE * float(np.median(surface.deviation)) if len(surface.faces) else np.inf
    # Handles of a surface that is hardly known are not told from others.
    if lawful or unsure > state.tolerance:
        return surface
    size = 2.0 * max(state.tolerance, float(np.median(body.samples.steps)))
    return without_small_handles(surface, state.rims, size)


def _drawn(body: Body, sagitta: float) -> Surface:
    """The surface of a body in cubes that show its shape. A body with edges that is not closed so
    is drawn in cubes as small as its curvature asks, which show better where it ends."""
    large, fine = shape_edge(body), fine_edge(body, sagitta)
    surface = body_surface(body, large)
    if fine >= large or not len(igl.boundary_facets(surface.faces)[0]):
        return surface
    return body_surface(body, fine)


def _body_of(state: AtlasState) -> Body:
    """The body of an atlas, if it has one."""
    if not isinstance(state, AtlasState):
        raise ValueError(f"got {type(state).__name__}; a surface is drawn of an Atlas")
    if state.body is None:
        raise ValueError(
            "the atlas has learned from no touch yet, so it has no surface; add a touch with three "
            "contours, or see in planner.stop why no touch taught anything"
        )
    return state.body


def _checked(body: Body, edge: float) -> float:
    """The edge of the cubes, if a surface of them can be made: the memory is 4 kB, as measured, for
    each of two triangles in each cube on the square of the body's extent, the area of a ball."""
    if not 0.0 < real(edge) <= body.extent:
        raise ValueError(
            f"edge is {edge}; it must be a length > 0 and no more than the {body.extent:.4g} that "
            "the samples span: leave it out for a fitting one"
        )
    gigabytes = 16
    least = float(np.sqrt(2.0 * 4e3 / (gigabytes * 2.0**30))) * body.extent
    if edge < least:
        raise ValueError(
            f"edge is {edge:.4g}: triangles so small would take more than {gigabytes} GB of "
            f"memory; give one of {1.1 * least:.2g} or more"
        )
    return float(edge)


def with_fewer_patches(known: KnownBody, tolerance: float) -> KnownBody:
    """What is known, with a free-form body of fewer patches that is mostly off by no more than a
    quarter of a tolerance (length): see ``fewer_sextics``. The body has its rims already.

    Beside openings the patches of samples tell where the surface is no longer known, so that these
    stay. Those of a body with sharp turns cut each other, and stay as well.
    """
    body = known.body
    if body is None or known.is_few or not body.is_one_face:
        return known
    surface = body.field.trees.free_form(0)
    if surface is None or len(surface.pairs):
        return known
    # Cubes larger than a seventh of a patch do not tell small patches from what they leave out.
    edge = max(min(coarse_edge(body), surface.radius / 7.0), body.extent / MOST)
    # Patches follow from samples alone, whether or not a probe passed through their surface.
    whole = body.with_air(np.zeros((0, 2, 3)), body.rims)
    drawn = without_stray_pieces(body_surface(whole, edge), body.samples.points)
    if not len(drawn.faces):
        return known
    ends = np.zeros(len(drawn.vertices) + len(body.seeds), bool)
    ends[igl.boundary_facets(drawn.faces)[0].ravel()] = True
    # Between drawn points a narrow bend shows at samples alone: the tip of a bottle was off by 0.4
    # tolerances.
    at = whole.field.at(body.seeds)
    feet = body.seeds - at.distance[:, None] * at.normal
    points = np.concatenate([drawn.vertices, feet])
    normals = np.concatenate([drawn.normals, at.normal])
    deviations = np.concatenate([drawn.deviation, at.deviation])
    count = len(drawn.vertices)
    given = points, normals, deviations, ends, count, edge, tolerance, body.samples.levels
    fewer = fewer_sextics(surface, *given)
    if fewer is surface:
        return known
    return replace(known, is_few=True, body=body.with_surface(fewer))
