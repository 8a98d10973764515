"""Triangles as plane faces of the CAD kernel."""

import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import surface_of
from touchatlas.atlas.cad.occ_kernel import is_solid
from touchatlas.atlas.cad.occ_triangles import triangle_shapes

pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")


def volume(shape) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def test_closed_triangles_are_one_solid_of_their_volume():
    mesh = trimesh.creation.icosphere(2, 10.0)
    (found,) = triangle_shapes(surface_of(mesh))
    assert is_solid(found)
    assert len(found.faces) == len(mesh.faces)
    assert volume(found.shape) == pytest.approx(mesh.volume, rel=1e-9)


def test_two_bodies_are_two_solids_and_an_open_one_a_shell():
    whole, holed = trimesh.creation.box([2.0, 2.0, 2.0]), trimesh.creation.box([1.0, 1.0, 1.0])
    holed.apply_translation([5.0, 0.0, 0.0])
    holed.update_faces(np.arange(12) > 0)
    shapes = triangle_shapes(surface_of(trimesh.util.concatenate([whole, holed])))
    assert sorted(map(is_solid, shapes)) == [False, True]
