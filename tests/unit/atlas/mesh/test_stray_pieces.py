"""A closed atlas has one connected surface; an open one keeps all its pieces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from touchatlas.atlas import extract_surface
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces


def with_a_piece_beside(surface, offset):
    """The surface and a copy of the triangles about its first vertex at an offset."""
    near = np.linalg.norm(surface.vertices - surface.vertices[0], axis=1) < 5.0
    some = surface.faces[near[surface.faces].all(axis=1)]
    corners, beside = np.unique(some, return_inverse=True)
    columns = {
        name: np.concatenate([column, column[corners]])
        for name, column in vars(surface).items()
        if name not in ("vertices", "faces", "stray_pieces", "closed_holes")
    }
    vertices = np.concatenate([surface.vertices, surface.vertices[corners] + offset])
    faces = np.concatenate([surface.faces, beside.reshape(-1, 3) + len(surface.vertices)])
    return replace(surface, vertices=vertices, faces=faces, **columns)


@pytest.fixture(scope="module")
def whole():
    return explored("sphere").atlas


def test_a_piece_beside_a_closed_surface_is_removed_and_counted(whole):
    surface = extract_surface(whole)
    spoilt = with_a_piece_beside(surface, [0.0, 0.0, 3.0])
    mended = without_stray_pieces(whole, spoilt)
    mesh = trimesh.Trimesh(mended.vertices, mended.faces, process=False)
    assert mended.stray_pieces == 1 and mesh.is_watertight and mesh.euler_number == 2
    assert len(mended.vertices) == len(surface.vertices)


def test_a_closed_surface_of_one_piece_is_left_as_it_is(whole):
    surface = extract_surface(whole)
    assert surface.stray_pieces == 0 and without_stray_pieces(whole, surface) is surface


def test_pieces_of_an_open_atlas_stay():
    half = explored("sphere", max_touches=20).atlas
    spoilt = with_a_piece_beside(extract_surface(half), [0.0, 0.0, 3.0])
    assert without_stray_pieces(half, spoilt) is spoilt
