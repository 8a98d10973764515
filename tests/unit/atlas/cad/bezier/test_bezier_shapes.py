"""Bezier faces as shapes of the CAD kernel."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball_of, surface_of
from tests.unit.atlas.cad.test_occ_triangles import volume
from touchatlas.atlas.cad.bezier.bezier_shapes import bezier_shapes
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_kernel import is_solid

pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
BOUND = 0.02


def body(radius: float):
    """What Bezier faces ask of a body that is a ball."""

    def at(points):
        distance, normal = ball_of(radius)(points)
        return SimpleNamespace(distance=distance, normal=normal)

    faces = SimpleNamespace(faces=[SimpleNamespace(words="free-form face")])
    return SimpleNamespace(field=SimpleNamespace(at=at), faces=faces)


@pytest.mark.parametrize("radius", [RADIUS, 5e-3 * RADIUS, 100.0 * RADIUS])
def test_a_ball_is_one_solid_of_its_volume_in_any_unit(radius):
    """As the faces are off by the bound at most, the volume is by that times the area."""
    bound, mesh = BOUND * radius / RADIUS, trimesh.creation.icosphere(5, radius)
    found = bezier_shapes(body(radius), surface_of(mesh), bound)
    (one,) = found.shapes
    assert is_solid(one) and len(one.faces) < 200
    area = 4.0 * np.pi * radius**2
    assert volume(one.shape) == pytest.approx(area * radius / 3.0, abs=found.gap * area)
    assert found.gap <= bound and np.degrees(found.turn) < 2.0
    assert set(one.names) == {"free-form face"}


def test_an_open_surface_is_not_written():
    mesh = trimesh.creation.icosphere(5, RADIUS)
    mesh.update_faces(np.arange(len(mesh.faces)) > 100)
    with pytest.raises(NotWritten, match="open"):
        bezier_shapes(body(RADIUS), surface_of(mesh), BOUND)


def test_a_surface_that_jumps_by_many_bounds_is_not_written():
    """Triangles follow a jump of the field, smooth faces do not."""
    mesh = trimesh.creation.icosphere(5, RADIUS)
    high = mesh.vertices[:, 0] > 0.3
    mesh.vertices[high] *= 1.0 + 20.0 * BOUND / RADIUS
    with pytest.raises(NotWritten, match="rough"):
        bezier_shapes(body(RADIUS), surface_of(mesh), BOUND)
