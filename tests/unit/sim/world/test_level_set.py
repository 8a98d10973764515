"""The truth mesh against the full grid, and against what its docstring promises."""

import igl
import numpy as np
import pytest
import trimesh

from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.level_set import level_set_mesh, newton_projection
from touchatlas.sim.world.objects import make_object, object_names


def mesh_of_the_full_grid(obj, half_extent, edge):
    """The same by marching cubes on every cell of the box."""
    axes = [np.arange(-h - 1.5 * edge, h + 2.5 * edge, edge) for h in half_extent]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    grid = np.stack([a.transpose(2, 1, 0).ravel() for a in (x, y, z)], axis=1)
    vertices, faces, _ = igl.marching_cubes(obj.value(grid), grid, *map(len, axes))
    return newton_projection(obj.field, vertices), faces


@pytest.mark.parametrize("name", object_names())
def test_the_surface_is_that_of_the_full_grid(name):
    """A cell that was wrongly left out would leave a hole."""
    obj = make_object(name)
    half_extent = 0.5 * np.ptp(obj.bounds, axis=0) + np.abs(obj.bounds.mean(axis=0))
    edge = 2.0 * half_extent.max() / 60
    vertices, faces = level_set_mesh(obj.field, half_extent, edge)
    expected, expected_faces = mesh_of_the_full_grid(obj, half_extent, edge)
    assert (faces == expected_faces).all()
    assert np.abs(vertices - expected).max() <= 1e-12 * obj.diagonal


@pytest.mark.parametrize("name", object_names())
def test_vertices_lie_on_the_surface_and_the_mesh_is_closed_and_outward(name):
    obj = make_object(name)
    vertices, faces = obj.mesh(obj.tolerance)
    value, gradient = obj.field.first_order(vertices)
    assert np.abs(value / np.linalg.norm(gradient, axis=1)).max() < 1e-9 * obj.diagonal
    assert igl.euler_characteristic(faces) == obj.euler_characteristic
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() > 0.0


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "torus", "bottle", "mouse", "blob"])
def test_chords_stay_within_the_stated_sagitta(name):
    """A chord c is off an arc of curvature k by c^2 k / 8, and the diagonal of a cell is sqrt(3)
    edges long. The sagitta is stated for an edge where k r = 1, r a tenth of the least extent of
    the box that an object is given, which is up to 1.4 times as large as the object."""
    obj = make_object(name)
    sagitta, radius = obj.tolerance, 0.14 * np.ptp(obj.bounds, axis=0).min()
    vertices, faces = obj.mesh(sagitta)
    ends = vertices[faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
    middle = ends.mean(axis=1)
    value, gradient = obj.field.first_order(middle)
    off = np.abs(value) / np.linalg.norm(gradient, axis=1)
    places = [obj.project(points) for points in (middle, ends[:, 0], ends[:, 1])]
    curvature = np.max([np.abs(obj.principal_curvatures(x)[:2]).max(axis=0) for x in places], 0)
    assert (off <= 3.0 * sagitta * np.maximum(radius * curvature, 0.1)).all()
    assert np.quantile(off, 0.95) <= sagitta


def test_few_points_are_evaluated():
    """Of a grid of 200 cells along each side, fewer than 10 for each cell that is crossed."""
    ball, counts = make_object("sphere").field, []

    def counted(points):
        counts.append(len(points))
        return ball.first_order(points)

    edge = 66.0 / 200
    vertices, _ = level_set_mesh(Field(counted, ball.hessian), (33.0,) * 3, edge)
    newton = 6 * len(vertices)
    assert sum(counts) - newton < 10 * 4.0 * np.pi * 33.0**2 / edge**2


def test_the_truth_of_the_cube_has_sharp_edges():
    """Cubes of a grid would cut them off, by up to half a cell: six faces of 60 by 60, a volume of
    60^3, and every corner."""
    cube = make_object("cube")
    vertices, faces = cube.mesh(cube.tolerance)
    mesh = trimesh.Trimesh(vertices, faces)
    np.testing.assert_allclose((mesh.area, mesh.volume), (6.0 * 60.0**2, 60.0**3))
    assert mesh.is_watertight and np.abs(mesh.vertices).min() == 30.0
