"""Fewer triangles against the triangles that they stand for."""

from functools import lru_cache

import igl
import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import surface_of
from touchatlas.atlas.cad.fewer_triangles import fewer_triangles
from touchatlas.atlas.records.surface import Surface

RADIUS = 7.5


def ball() -> Surface:
    return surface_of(trimesh.creation.icosphere(4, RADIUS))


@lru_cache
def fewer_of_ball(bound: float) -> Surface:
    return fewer_triangles(ball(), bound)


def box() -> trimesh.Trimesh:
    mesh = trimesh.creation.box([40.0, 30.0, 20.0])
    for _ in range(3):
        mesh = mesh.subdivide()
    return mesh


def is_closed(surface: Surface) -> bool:
    return not len(igl.boundary_facets(surface.faces)[0])


@pytest.mark.parametrize("bound", [0.02, 0.1, 0.5])
def test_triangles_of_a_ball_are_within_the_bound_of_it(bound):
    """The triangles of the ball itself are 0.01 within it."""
    found = fewer_of_ball(bound)
    off = np.linalg.norm(found.vertices[found.faces].mean(axis=1), axis=1) - RADIUS
    assert np.abs(off).max() < bound + 0.01
    assert is_closed(found)


def test_their_number_falls_as_the_bound_grows():
    """It is inverse to the sagitta: a factor of five, of which a step of 0.7 may lack."""
    fine, coarse = (len(fewer_of_ball(bound).faces) for bound in (0.1, 0.5))
    assert fine / coarse == pytest.approx(5.0, rel=0.5)
    assert fine < 0.5 * len(ball().faces)


def test_sides_of_a_box_are_two_triangles_each():
    found = fewer_triangles(surface_of(box()), 1e-6)
    assert len(found.faces) == 12
    assert is_closed(found)
    corners = np.abs(found.vertices)
    assert corners == pytest.approx(np.tile([20.0, 15.0, 10.0], (8, 1)), abs=1e-6)


def test_the_rim_of_an_open_surface_stays_where_it_is():
    mesh = box()
    mesh.update_faces(mesh.triangles_center[:, 2] < 9.9)
    mesh.remove_unreferenced_vertices()
    found = fewer_triangles(surface_of(mesh), 1e-6)
    assert len(found.faces) < 0.1 * len(mesh.faces)
    rim = found.vertices[np.unique(igl.boundary_facets(found.faces)[0])]
    assert rim[:, 2] == pytest.approx(10.0, abs=1e-6)


def test_each_vertex_keeps_the_face_it_was_of():
    two = [trimesh.creation.icosphere(3, 1.0), trimesh.creation.icosphere(3, 1.0)]
    two[1].apply_translation([5.0, 0.0, 0.0])
    whole = surface_of(trimesh.util.concatenate(two))
    whole.patch[len(two[0].vertices) :] = 1
    found = fewer_triangles(whole, 0.02)
    assert len(found.faces) < len(whole.faces)
    assert (found.patch == (found.vertices[:, 0] > 2.5)).all()


def test_nothing_stays_nothing():
    empty = surface_of(trimesh.creation.box()).only(np.zeros(8, bool))
    assert not len(fewer_triangles(empty, 1.0).faces)
