"""The patches of a finished atlas: as few as the tolerance asks, however it is made."""

from copy import deepcopy

import numpy as np
import pytest
import trimesh

from tests.explored import explored, learned_at_once, spread_touches
from touchatlas.atlas import load_atlas, save_atlas
from touchatlas.atlas.mesh.surface import with_fewer_patches
from touchatlas.atlas.store import atlas_bytes
from touchatlas.sim import make_object
from touchatlas.sim.world.mesh_object import MeshObject

SMOOTH = ["bottle", *(pytest.param(x, marks=pytest.mark.slow) for x in ("blob", "mouse"))]


@pytest.mark.parametrize("name", SMOOTH)
def test_a_smooth_body_has_40_patches_at_most(name):
    assert len(explored(name).atlas) <= 40


@pytest.mark.parametrize("name", SMOOTH)
def test_a_finished_body_is_off_the_one_before_by_hardly_more_than_a_quarter_of_the_tolerance(name):
    found = explored(name)
    before = learned_at_once(found.touches, found.atlas.tolerance)
    points = before.pool.points
    off = found.atlas.body.field.at(points).distance - before.body.field.at(points).distance
    # At the points of the drawing, and at one sample of each cube, the bound holds for each sextic;
    # between them for nearly all samples, and for the others nearly.
    assert (np.abs(off) > 0.25 * before.tolerance).mean() < 0.01
    assert np.abs(off).max() < 0.35 * before.tolerance
    assert len(found.atlas) <= len(before) / 2


def test_finished_again_nothing_changes():
    atlas = explored("bottle").atlas
    known = atlas.known_body
    atlas.finish()
    assert atlas.known_body is known and known.is_few


def test_touches_after_the_end_are_learned_as_before_it():
    """The samples are the same, and the body is that of the samples."""
    found = explored("bottle")
    atlas = learned_at_once(found.touches[:-1], 0.1)
    whole = deepcopy(atlas)
    whole.add(found.touches[-1])
    atlas.finish()
    assert atlas.known_body.is_few and not whole.known_body.is_few
    atlas.add(found.touches[-1])
    assert not atlas.known_body.is_few and len(atlas) == len(whole)
    points = whole.pool.points
    one, other = (each.body.field.at(points) for each in (atlas, whole))
    assert one.distance.tobytes() == other.distance.tobytes()


def test_a_finished_atlas_is_loaded_as_it_was_saved(tmp_path):
    atlas = explored("bottle").atlas
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    assert atlas_bytes(again) == atlas_bytes(atlas) and len(again) == len(atlas)
    points = atlas.pool.points
    one, other = (each.body.field.at(points) for each in (atlas, again))
    assert np.abs(one.distance - other.distance).max() < 1e-6 * atlas.tolerance
    again.validate()


@pytest.mark.parametrize("name", ["sphere", pytest.param("cube", marks=pytest.mark.slow)])
def test_a_body_of_laws_stays(name):
    known = explored(name).atlas.known_body
    assert with_fewer_patches(known, 0.1) is known and not known.is_few


def test_a_body_that_no_fewer_patches_follow_stays():
    """The tolerance is a thousandth of the noise, and seven touches leave most of a bottle open."""
    atlas = learned_at_once(explored("bottle").touches[:7], 2e-5)
    known = atlas.known_body
    assert with_fewer_patches(known, atlas.tolerance) is known


def test_a_finished_open_body_is_valid_and_loaded_as_it_was_saved(tmp_path):
    """Rims, where contact was lost, tell where the surface is drawn."""
    vertices, faces = make_object("blob").mesh(0.1)
    mesh = trimesh.Trimesh(vertices, faces)
    mesh.update_faces(mesh.triangles_center[:, 2] > -15.0)
    mesh.remove_unreferenced_vertices()
    obj = MeshObject("open", np.array(mesh.vertices), np.array(mesh.faces))
    atlas = learned_at_once(spread_touches(obj, 18, 0.02), 0.1)
    atlas.finish()
    assert atlas.known_body.is_few and len(atlas.rims.ends.points)
    atlas.validate()
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    points = atlas.pool.points
    one, other = (each.body.field.at(points) for each in (atlas, again))
    assert len(again) == len(atlas)
    assert np.abs(one.distance - other.distance).max() < 1e-6 * atlas.tolerance
