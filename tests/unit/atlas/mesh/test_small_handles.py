"""Handles that are smaller than the smallest patch are left out; others stay."""

from functools import lru_cache

import igl
import numpy as np
import pytest
import trimesh

from tests.meshes import euler_number, surface_of
from touchatlas.atlas.mesh.handles import handle_count, short_loops, without_small_handles
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import box_diagonal

# Coordinates of the grid along each axis, none of which is on the surface, where cubes have edges
# of no length: the rings reach to 1.6 on one side, and the ball alone to -1 on the other. The
# rounding of creases is one in which no cube is ambiguous.
_AXIS, _ROUND = np.linspace(-1.094, 1.7, 67), 0.03
NO_RIMS = Rims(SamplePool())


def triangles(vertices, faces) -> Surface:
    """A Surface of triangles alone."""
    return surface_of(trimesh.Trimesh(vertices, faces, process=False), 0.01, 1.0)


@lru_cache
def ball_with_rings(*radii: float) -> Surface:
    """A unit ball with an upright ring half out of it for each radius, a third as thick."""
    grid = np.stack(np.meshgrid(_AXIS, _AXIS, _AXIS, indexing="ij"), axis=-1).reshape(-1, 3)
    value = np.linalg.norm(grid, axis=1) - 1.0
    for radius, middle in zip(radii, np.eye(3), strict=False):
        offset = grid - middle
        along = offset @ middle
        across = np.roll(middle, 1)
        side = offset @ across
        flat = np.hypot(along, side) - radius
        depth = np.linalg.norm(offset - along[:, None] * middle - side[:, None] * across, axis=1)
        ring = np.hypot(flat, depth) - radius / 3.0
        value = -_ROUND * np.logaddexp(-value / _ROUND, -ring / _ROUND)
    vertices, faces, *_ = igl.marching_cubes(value, grid, *3 * [len(_AXIS)], 0.0)
    assert len(igl.split_nonmanifold(faces)[1]) == len(vertices)
    return triangles(vertices, faces)


def test_small_handles_are_cut_and_large_ones_stay():
    """A loop round the tube of a ring of radius 0.15 is 0.1 wide: its box has a diagonal of 0.15
    with edges of 0.042. One round that of a ring of 0.45 is 0.3 wide."""
    body = ball_with_rings(0.15, 0.45)
    assert handle_count(body) == 2 and euler_number(body) == -2
    mended = without_small_handles(body, NO_RIMS, 0.15)
    assert handle_count(mended) == 1 and euler_number(mended) == 0
    assert len(mended.closed_holes) == 2
    mesh = mended.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1
    # Only vertices at the loops are gone, and the new ones lie among them.
    assert np.abs(np.linalg.norm(mended.closed_holes, axis=1) - 1.0).max() < 0.3


def test_what_has_no_small_handle_stays_as_it_is():
    body = ball_with_rings(0.4)
    assert without_small_handles(body, NO_RIMS, 0.1) is body
    nothing = body.only(np.zeros(len(body.vertices), bool))
    assert without_small_handles(nothing, NO_RIMS, 0.1) is nothing
    ball = ball_with_rings()
    assert without_small_handles(ball, NO_RIMS, 10.0) is ball


def test_a_handle_that_would_stay_open_leaves_others_to_be_cut():
    """Holes of a tenth of the body at most are closed. A loop round the larger ring is wider."""
    found = without_small_handles(ball_with_rings(0.15, 0.45), NO_RIMS, 10.0)
    assert found.to_trimesh().is_watertight
    assert handle_count(found) == 1


def beside(first: Surface, second: Surface) -> Surface:
    """Both surfaces as one."""
    count = len(first.vertices)
    vertices = np.concatenate([first.vertices, second.vertices])
    return triangles(vertices, np.concatenate([first.faces, second.faces + count]))


def test_a_small_body_beside_leaves_others_to_be_cut():
    """A copy at a fifth of the size, four beside: what is a small hole of both is none of the copy,
    and stays open there."""
    body = ball_with_rings(0.15)
    small = triangles(0.2 * body.vertices + np.array([4.0, 0.0, 0.0]), body.faces)
    found = without_small_handles(beside(body, small), NO_RIMS, 0.15)
    assert handle_count(found) < 2
    assert found.to_trimesh().is_watertight


def test_a_small_open_piece_is_looked_through_once():
    """A torus smaller than a patch, without one triangle: its region is all of it in the end."""
    ring = trimesh.creation.torus(0.06, 0.02, major_sections=24, minor_sections=12)
    piece = triangles(np.array(ring.vertices) + [4.0, 0.0, 0.0], np.array(ring.faces)[1:])
    both = beside(ball_with_rings(), piece)
    assert handle_count(without_small_handles(both, NO_RIMS, 0.1)) <= 1


def test_a_handle_of_an_open_surface_is_cut_and_its_opening_stays():
    """Below a height of -0.5 the ball is open: a rim and a handle."""
    body = ball_with_rings(0.15)
    open_body = body.only(body.vertices[:, 1] > -0.5)
    assert euler_number(open_body) == -1
    found = without_small_handles(open_body, NO_RIMS, 0.15)
    assert euler_number(found) == 1
    assert len(igl.boundary_loop_all(found.faces)) == 1


def test_a_torus_has_the_loops_around_its_tube_and_its_hole():
    """Two loops for one handle, as wide as the circles of radius 0.25 and of 0.75 at least; those
    through one root are no longer than twice that."""
    mesh = trimesh.creation.torus(1.0, 0.25, major_sections=96, minor_sections=32)
    short, long = short_loops(mesh.vertices, mesh.faces)
    assert 0.5 * 0.99 <= box_diagonal(mesh.vertices[short]) <= 1.0
    assert 1.5 * 0.99 <= box_diagonal(mesh.vertices[long]) <= 3.0
    turn = np.unwrap(np.arctan2(*mesh.vertices[np.append(short, short[0])][:, 1::-1].T))
    assert abs(turn[-1] - turn[0]) < 1e-9
    turn = np.unwrap(np.arctan2(*mesh.vertices[np.append(long, long[0])][:, 1::-1].T))
    assert abs(turn[-1] - turn[0]) == pytest.approx(2.0 * np.pi)


def test_a_handle_whose_cut_would_stay_open_is_not_cut():
    """A torus with a tube as thick as its hole: the two ends are too wide to be closed."""
    mesh = trimesh.creation.torus(2.0, 1.0, major_sections=60, minor_sections=40)
    body = surface_of(mesh, 0.01, 1.0)
    assert handle_count(body) == 1
    assert without_small_handles(body, NO_RIMS, 10.0) is body
