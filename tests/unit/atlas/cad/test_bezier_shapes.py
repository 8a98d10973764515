"""Bezier faces as shapes of the CAD kernel."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball
from tests.unit.atlas.cad.test_occ_triangles import surface_of, volume
from touchatlas.atlas.cad.bezier_shapes import bezier_shapes
from touchatlas.atlas.cad.face_layout import NotWritten
from touchatlas.atlas.cad.occ_kernel import is_solid

pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
BOUND = 0.02


def body():
    def at(points):
        distance, normal = ball(points)
        return SimpleNamespace(distance=distance, normal=normal)

    faces = SimpleNamespace(faces=[SimpleNamespace(words="free-form face")])
    return SimpleNamespace(field=SimpleNamespace(at=at), faces=faces)


def test_a_ball_is_one_solid_of_its_volume():
    """As the faces are off by the bound at most, the volume is by that times the area."""
    found = bezier_shapes(body(), surface_of(trimesh.creation.icosphere(5, RADIUS)), BOUND)
    (one,) = found.shapes
    assert is_solid(one) and len(one.faces) < 200
    area = 4.0 * np.pi * RADIUS**2
    assert volume(one.shape) == pytest.approx(area * RADIUS / 3.0, abs=found.gap * area)
    assert found.gap <= BOUND and np.degrees(found.turn) < 2.0
    assert set(one.names) == {"free-form face"}


def test_an_open_surface_is_not_written():
    mesh = trimesh.creation.icosphere(5, RADIUS)
    mesh.update_faces(np.arange(len(mesh.faces)) > 100)
    with pytest.raises(NotWritten, match="open"):
        bezier_shapes(body(), surface_of(mesh), BOUND)
