"""Bezier faces of smooth surfaces, whose best fits and volumes are known."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.meshes import surface_of
from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball, ball_of, cube_quads, volume
from touchatlas.atlas.cad.bezier import (
    curve_points,
    face_points,
)
from touchatlas.atlas.cad.bezier_fit import NearSurface, bezier_faces, coarse_triangles
from touchatlas.atlas.cad.bezier_shapes import bezier_shapes
from touchatlas.atlas.cad.bezier_tree import first_tree, with_halved
from touchatlas.atlas.cad.kernel import NotWritten

T = np.linspace(0.0, 1.0, 11)
U, V = (x.ravel() for x in np.meshgrid(T, T))
BOUND = 0.02


def off(tree) -> np.ndarray:
    """Distances of all faces from the ball of ``RADIUS``."""
    return np.abs(ball(face_points(np.array(tree.controls), U, V).reshape(-1, 3))[0])


def test_neighbouring_faces_share_their_edge_curves():
    """A face beside others that were halved twice keeps its side, of which they have quarters."""
    tree = first_tree(*cube_quads(), ball)
    for chosen in ([0], [0, 6, 7], [1, 2], range(9)):
        tree, _ = with_halved(tree, list(chosen), ball)
        for uses, control in zip(tree.faces, tree.controls, strict=True):
            for use, first, last in tree.edges(uses):
                along = first + T[:, None] * (last - first)
                gap = face_points(control, *along.T) - curve_points(tree.control(use), T)
                assert np.abs(gap).max() < 1e-13 * RADIUS


@pytest.mark.parametrize("bound", [1e-1, 1e-4])
def test_faces_are_within_the_bound_and_few(bound):
    """The error falls with the fourth power of the size at least: for a thousandth of the bound
    there are less than 1000^(2 / 4) as many."""
    tree, errors = bezier_faces(*cube_quads(), ball, bound)
    assert errors.max() <= bound and off(tree).max() <= 1.3 * bound
    assert len(tree.faces) <= {1e-1: 6, 1e-4: 6 * 16}[bound]


def test_only_faces_of_a_bump_are_halved():
    """The ball has a bump of a tenth of it around the x-axis; its distance is of first order."""

    def bumpy(points):
        distance, normal = ball(points)
        bump = 0.1 * RADIUS * np.exp(8.0 * (normal[:, 0] - 1.0))
        across = np.eye(3)[0] - normal[:, :1] * normal
        slope = normal - (8.0 * bump / (distance + RADIUS))[:, None] * across
        length = np.linalg.norm(slope, axis=1)
        return (distance - bump) / length, slope / length[:, None]

    tree, errors = bezier_faces(*cube_quads(), bumpy, 1e-2)
    middles = face_points(np.array(tree.controls), [0.5], [0.5])[:, 0]
    assert errors.max() <= 1e-2
    assert (middles[:, 0] < -0.9 * RADIUS).sum() == 1
    assert (middles[:, 0] > 0.5 * RADIUS).sum() >= 16


def test_where_a_surface_jumps_by_less_than_two_bounds_faces_stay():
    """Halves of faces across a jump are no nearer to it."""

    def torn(points):
        distance, normal = ball(points)
        return distance - 0.1 * (points[:, 0] > 0.3), normal

    tree, errors = bezier_faces(*cube_quads(), torn, 0.04)
    assert 0.04 < errors.max() < 0.08
    assert len(tree.faces) < 100


@pytest.mark.parametrize(
    ("mesh", "euler"),
    [
        (trimesh.creation.icosphere(4), 2),
        (trimesh.creation.torus(30.0, 10.0, major_sections=96, minor_sections=48), 0),
    ],
)
def test_coarse_triangles_have_the_topology_of_the_surface(mesh, euler):
    found = trimesh.Trimesh(*coarse_triangles(surface_of(mesh)), process=False)
    assert found.is_watertight and found.euler_number == euler
    assert len(found.faces) < 0.1 * len(mesh.faces)


def test_a_surface_whose_normals_point_anywhere_is_torn():
    surface = surface_of(trimesh.creation.icosphere(4, RADIUS))
    surface.normals[::50] *= -1.0
    with pytest.raises(NotWritten, match="torn"):
        coarse_triangles(surface)


def field_of(radius: float):
    """The field of a ball."""

    def at(points):
        distance, normal = ball_of(radius)(points)
        return SimpleNamespace(distance=distance, normal=normal)

    return SimpleNamespace(at=at)


@pytest.mark.parametrize(("beyond", "wanted"), [(0.0, 0.0), (0.05, 0.05), (0.3, 0.0)])
def test_a_field_decides_near_the_triangles_and_triangles_elsewhere(beyond, wanted):
    """A field whose surface is ``beyond`` a ball, of which triangles are 4e-3 inside."""
    surface = surface_of(trimesh.creation.icosphere(5, RADIUS))
    points = 1.02 * RADIUS * trimesh.creation.icosphere(3, 1.0).vertices
    distance, normal = NearSurface(field_of(RADIUS + beyond), surface, 0.1).at(points)
    assert distance == pytest.approx(0.02 * RADIUS - wanted, abs=5e-3)
    assert normal == pytest.approx(points / np.linalg.norm(points, axis=1)[:, None], abs=1e-2)


def shapes_of(mesh, radius: float = RADIUS, bound: float = BOUND):
    faces = SimpleNamespace(faces=[SimpleNamespace(words="free-form face")])
    body = SimpleNamespace(field=field_of(radius), faces=faces)
    return bezier_shapes(body, surface_of(mesh), bound)


@pytest.mark.parametrize("scale", [1.0, 5e-3, 100.0])
def test_a_ball_is_one_solid_of_its_volume_in_any_unit(kernel, scale):
    """As the faces are off by the bound at most, the volume is by that times the area."""
    radius, bound = scale * RADIUS, scale * BOUND
    found = shapes_of(trimesh.creation.icosphere(4, radius), radius, bound)
    (one,) = found.shapes
    assert one.is_solid and len(one.faces) < 200
    area = 4.0 * np.pi * radius**2
    assert volume(one.shape) == pytest.approx(area * radius / 3.0, abs=found.gap * area)
    assert found.gap <= bound and 0.0 < np.degrees(found.turn) < 2.0
    assert set(one.names) == {"free-form face"}


def test_open_surfaces_and_those_that_jump_by_many_bounds_are_not_written(kernel):
    """Triangles follow a jump of the field, smooth faces do not."""
    mesh = trimesh.creation.icosphere(4, RADIUS)
    mesh.update_faces(np.arange(len(mesh.faces)) > 100)
    with pytest.raises(NotWritten, match="open"):
        shapes_of(mesh)
    mesh = trimesh.creation.icosphere(5, RADIUS)
    mesh.vertices[mesh.vertices[:, 0] > 0.3] *= 1.0 + 20.0 * BOUND / RADIUS
    with pytest.raises(NotWritten, match="rough"):
        shapes_of(mesh)
