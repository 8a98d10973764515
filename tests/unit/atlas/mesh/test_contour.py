"""Dual contouring keeps edges and corners sharp, and its mesh is a manifold."""

from itertools import product

import igl
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from touchatlas.atlas.mesh.contour import dual_contour
from touchatlas.atlas.mesh.cubes import EDGES, corners_of, key, sheets_of

_HALF = np.array([1.0, 0.7, 0.5])
# A position in which no plane or axis is parallel to the lattice.
_TURN = Rotation.from_euler("xyz", [0.4, 0.3, 1.1]).as_matrix()


def extreme(parts, pick):
    """The largest or smallest (``pick``) of several distances, with its normal."""
    distance, normal = (np.stack(column) for column in zip(*parts, strict=True))
    chosen, row = pick(distance, axis=0), np.arange(distance.shape[1])
    return distance[chosen, row], normal[chosen, row]


def box(low, high):
    """A box: the largest distance from six planes."""

    def body(points):
        sides = [(side * axis, side) for axis in np.eye(3) for side in (1.0, -1.0)]
        planes = [
            ((points - (high if side > 0.0 else low)) @ out, np.tile(out, (len(points), 1)))
            for out, side in sides
        ]
        return extreme(planes, np.argmax)

    return body


def step(points):
    """Two boxes that form a stair."""
    parts = [box([-1, -1, -1], [1, 1, 0]), box([-1, -1, -1], [0.1, 1, 1])]
    return extreme([part(points) for part in parts], np.argmin)


def cylinder(points):
    """A closed cylinder of radius 1 and height 1.4 about z."""
    radius = np.hypot(points[:, 0], points[:, 1])
    outward = points * [1, 1, 0] / np.maximum(radius, 1e-9)[:, None]
    flat = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    ends = [(side * points[:, 2] - 0.7, side * flat) for side in (1.0, -1.0)]
    return extreme([(radius - 1.0, outward), *ends], np.argmax)


def sphere(points):
    """A unit sphere."""
    radius = np.linalg.norm(points, axis=1)
    return radius - 1.0, points / np.maximum(radius, 1e-9)[:, None]


def torus(points):
    """A torus of radii 1 and 0.4 about z."""
    flat = points * [1, 1, 0]
    offset = points - flat / np.maximum(np.linalg.norm(flat, axis=1), 1e-9)[:, None]
    radius = np.linalg.norm(offset, axis=1)
    return radius - 0.4, offset / np.maximum(radius, 1e-9)[:, None]


def turned(body, axes=_TURN):
    """A body with its axes along the columns of a matrix (3, 3)."""

    def turned_body(points):
        distance, normal = body(points @ axes)
        return distance, normal @ axes.T

    return turned_body


def known(body):
    """The body, known everywhere."""
    return lambda points: (*body(points), np.ones(len(points), bool), np.zeros(len(points), bool))


def mesh_of(body, seed, edge: float) -> trimesh.Trimesh:
    """The mesh of a body, which is closed and of consistent winding."""
    mesh = trimesh.Trimesh(*dual_contour(body, known(body), [seed], edge), process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    return mesh


@pytest.mark.parametrize("edge", [0.3, 0.17])
@pytest.mark.parametrize("axes", [np.eye(3), _TURN], ids=["along", "turned"])
def test_a_box_has_exact_corners_edges_and_volume(axes, edge):
    """All planes meet within the solve of three equations: rounding is all that is left, far below
    1e-6. The volume is positive, so the faces look outward."""
    body = turned(box(-_HALF, _HALF), axes)
    mesh = mesh_of(body, axes @ [1.0, 0.0, 0.0], edge)
    assert mesh.euler_number == 2
    assert np.abs(body(mesh.vertices)[0]).max() < 1e-6
    corners = np.array(list(product(*zip(-_HALF, _HALF, strict=True)))) @ axes.T
    missed = np.linalg.norm(corners[:, None] - mesh.vertices, axis=2).min(axis=1)
    assert missed.max() < 1e-6
    assert mesh.volume == pytest.approx(8.0 * _HALF.prod(), rel=1e-6)


@pytest.mark.parametrize("axes", [np.eye(3), _TURN], ids=["along", "turned"])
def test_a_concave_edge_is_as_exact_as_a_convex_one(axes):
    """The stair encloses 4 + 2.2; rounding is all that is left."""
    mesh = mesh_of(turned(step, axes), axes @ [1.0, 0.0, -0.5], 0.17)
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(6.2, rel=1e-6)


def test_the_volume_of_a_cylinder_falls_with_the_square_of_the_edge():
    """Chords cut off arcs: halving the edge divides the error by 4, and by at least 3 where the
    lattice lies otherwise on the rims."""
    body = turned(cylinder)
    errors = []
    for edge in (0.2, 0.1, 0.05):
        mesh = mesh_of(body, _TURN @ [1.0, 0.0, 0.0], edge)
        assert mesh.euler_number == 2
        errors.append(1.4 * np.pi - mesh.volume)
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2] > 0.0


@pytest.mark.parametrize("edge", [0.3, 0.1])
def test_a_rim_of_a_cylinder_lies_on_both_surfaces(edge):
    """A vertex on the rim is a vertex within a tenth of an edge of both. The planes beside it are
    taken at a twentieth of an edge, so the error is about k edge^2 / 800, below edge / 1000."""
    mesh = mesh_of(cylinder, [1.0, 0.0, 0.0], edge)
    side = np.hypot(*mesh.vertices[:, :2].T) - 1.0
    end = np.abs(mesh.vertices[:, 2]) - 0.7
    rim = np.maximum(np.abs(side), np.abs(end)) < 0.1 * edge
    assert rim.sum() > 2.0 * 2.0 * np.pi / edge
    assert np.abs(side[rim]).max() < 1e-3 * edge
    assert np.abs(end[rim]).max() < 1e-3 * edge


def test_vertices_of_a_sphere_are_exact_and_the_volume_is_of_second_order():
    """Newton's step is exact for a true distance. The chords leave an error of order edge^2, which
    halves to a quarter, here between 3.5 and 4.5 times smaller."""
    errors = []
    for edge in (0.2, 0.1):
        mesh = mesh_of(sphere, [1.0, 0.0, 0.0], edge)
        assert mesh.euler_number == 2
        assert np.abs(sphere(mesh.vertices)[0]).max() < 1e-9
        errors.append(4.0 / 3.0 * np.pi - mesh.volume)
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_a_torus_has_one_handle():
    """The Euler number of a torus is 0."""
    assert mesh_of(torus, [1.4, 0.0, 0.0], 0.17).euler_number == 0


def test_a_wall_of_more_than_two_cubes_stays_two_sheets():
    """The wall is 2.2 cubes thick, and its planes and edges are exact."""
    half = np.array([1.0, 0.7, 0.11])
    mesh = mesh_of(box(-half, half), [1.0, 0.0, 0.0], 0.1)
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(8.0 * half.prod(), rel=1e-6)


def test_two_sheets_within_one_cube_leave_a_manifold():
    """Two balls have a gap of half an edge. They are two bodies without handles, or, where no node
    lies in the gap, one."""

    def two(points):
        balls = [(points - [x, 0.02, 0.02], x) for x in (-1.05, 1.05)]
        return extreme([sphere(part) for part, _ in balls], np.argmin)

    seeds = [[-2.05, 0.02, 0.02], [2.05, 0.02, 0.02]]
    mesh = trimesh.Trimesh(*dual_contour(two, known(two), seeds, 0.2), process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 2 * mesh.body_count


@pytest.mark.parametrize("joined", [True, False])
def test_any_signs_of_nodes_give_mesh_edges_of_two_faces(joined):
    """Random signs hold all ambiguous cases. A line on a face of two cubes has two ends, and no
    two lines join the same two sheets: each pair of sheets shares two crossed edges of a face."""
    inside = np.random.default_rng(3).random((13, 13, 13)) < 0.5
    cubes = key(np.indices((12, 12, 12)).reshape(3, -1).T)
    nodes = key(np.indices((13, 13, 13)).reshape(3, -1).T)
    inside = inside.ravel()[np.searchsorted(nodes, corners_of(cubes))]
    sheets = sheets_of(cubes, inside, lambda points: np.full(len(points), joined))
    for axis in range(3):
        # Edges of the upper face, and of the lower one, in the same order.
        order = np.lexsort([*np.delete(EDGES, axis, axis=1).T, EDGES[:, axis]])
        lower, upper = order[EDGES[order, 3] != axis].reshape(2, 4)
        block = np.moveaxis(sheets.reshape(12, 12, 12, 12), axis, 0)
        here, there = block[:-1, ..., upper], block[1:, ..., lower]
        assert np.array_equal(here < 0, there < 0)
        pairs = np.stack([here[here >= 0], there[here >= 0]], axis=1)
        assert np.all(np.unique(pairs, axis=0, return_counts=True)[1] == 2)


def test_the_surface_ends_where_it_is_unknown():
    """A ball that is known below a plane has one round rim, no vertex beyond by an edge, and is
    known up to two cubes from the plane: a cube with an unknown corner is left out."""
    edge, height = 0.1, 0.3

    def part(points):
        distance, normal = sphere(points)
        lower = points @ _TURN[:, 2] < height
        distance = np.where(lower, distance, np.nan)
        return distance, np.where(lower[:, None], normal, np.nan), lower, ~lower

    vertices, faces = dual_contour(sphere, part, [-_TURN[:, 2]], edge)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_winding_consistent
    rim = mesh.edges[trimesh.grouping.group_rows(mesh.edges_sorted, require_count=1)]
    assert len(trimesh.graph.connected_components(rim)) == 1
    assert np.all(np.bincount(rim.ravel())[np.unique(rim)] == 2)
    assert mesh.euler_number == 1
    up = vertices @ _TURN[:, 2]
    assert up.max() < height + edge
    # Two diagonals of a cube.
    assert up[np.unique(rim)].min() > height - 2.0 * np.sqrt(3.0) * edge


def test_unsure_corners_are_asked_once_and_end_the_surface_where_it_is_unknown():
    """A ball that is unsure, and in truth unknown, in a belt about it: of both caps the one with
    the seed is drawn, as where the belt is known to be unknown from the first."""
    asked = []

    def is_above(points):
        return points @ _TURN[:, 2] > 0.3

    def is_in_belt(points):
        return is_above(points) & (points @ _TURN[:, 2] < 0.6)

    def unknown(points):
        return *sphere(points), ~is_in_belt(points), np.zeros(len(points), bool)

    def unsure(points):
        return *sphere(points), np.ones(len(points), bool), is_above(points)

    def is_sure(points, distance, normal):
        assert distance == pytest.approx(sphere(points)[0])
        assert normal == pytest.approx(sphere(points)[1])
        asked.append(len(points))
        return ~is_in_belt(points)

    seeds = [-_TURN[:, 2]]
    one = dual_contour(sphere, unknown, seeds, 0.1)
    other = dual_contour(sphere, unsure, seeds, 0.1, is_sure=is_sure)
    assert one[0] == pytest.approx(other[0])
    assert np.array_equal(one[1], other[1])
    assert len(asked) == 1
    assert not is_above(one[0]).all() and (one[0] @ _TURN[:, 2]).max() < 0.4


def test_a_face_in_a_plane_of_the_lattice_leaves_no_degenerate_triangle():
    """The corner of the box lies on a node: its planes are planes of the lattice."""
    edge = 0.25
    seed = np.array([1.0, 0.0, 0.0])
    low = seed + np.array([0.31, 0.43, 0.37]) * edge - [8 * edge, 3 * edge, 3 * edge]
    high = low + [8 * edge, 5 * edge, 4 * edge]
    mesh = mesh_of(box(low, high), seed, edge)
    assert mesh.euler_number == 2
    assert mesh.area_faces.min() > 1e-6 * edge**2
    assert mesh.volume == pytest.approx(np.prod(high - low), rel=1e-6)


def thin_wedge(degrees: float):
    """A wedge of length 1 and height 1.03 about a turned z axis, and its volume."""
    half, turn = np.deg2rad(0.5 * degrees), Rotation.from_euler("z", 0.3).as_matrix()
    sides = [[-np.sin(half), side * np.cos(half), 0.0] for side in (1.0, -1.0)]
    normals = np.array([*sides, [1, 0, 0], [0, 0, 1], [0, 0, -1]]) @ turn.T

    def body(points):
        planes = zip(normals, [0.0, 0.0, 1.0, 0.513, 0.517], strict=True)
        parts = [(points @ n - level, np.tile(n, (len(points), 1))) for n, level in planes]
        return extreme(parts, np.argmax)

    return mesh_of(body, turn[:, 0], 0.05), np.tan(half) * 1.03


@pytest.mark.parametrize("degrees", [15.0, 20.0, 30.0, 45.0])
def test_a_thin_wedge_has_its_volume(degrees):
    """That of a prism, with rounding, though cubes at its edge are wider than it."""
    mesh, volume = thin_wedge(degrees)
    assert mesh.volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("degrees", [6.0, 8.0, 10.0, 20.0])
def test_a_thin_wedge_is_drawn_up_to_its_edge(degrees):
    """Points of the edge lie on triangles, with rounding."""
    mesh, _ = thin_wedge(degrees)
    edge = np.linspace(-0.51, 0.51, 200)[:, None] * [0.0, 0.0, 1.0]
    squared = igl.point_mesh_squared_distance(edge, mesh.vertices, mesh.faces.astype(np.int64))[0]
    assert np.sqrt(squared.max()) < 1e-9


def test_a_seed_off_the_surface_finds_nothing():
    """No cube near the seed is crossed: the mesh is empty."""
    vertices, faces = dual_contour(sphere, known(sphere), [[5.0, 0.0, 0.0]], 0.1)
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)


@pytest.mark.parametrize("edge", [0.0, -1.0, np.nan])
def test_an_edge_that_is_not_positive_is_refused(edge):
    with pytest.raises(ValueError, match="edge of the cubes must be positive"):
        dual_contour(sphere, known(sphere), [[1.0, 0.0, 0.0]], edge)


def test_no_seed_is_refused():
    with pytest.raises(ValueError, match="at least one seed"):
        dual_contour(sphere, known(sphere), np.zeros((0, 3)), 0.1)
