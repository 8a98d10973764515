"""STEP files of smooth faces and of triangles, read back by another program, gmsh, with its own
build of the CAD kernel; and triangles against those that they stand for."""

import subprocess
import sys

import igl
import numpy as np
import pytest
import trimesh

from tests.explored import learned, spread_touches
from tests.lawful import body_of, samples_of_touches, touched_mesh
from tests.lawful_meshes import HALF
from tests.meshes import surface_of
from tests.unit.atlas.cad.smooth_bodies import RADIUS, volume
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.choose import KnownBody, body_of_one
from touchatlas.atlas.cad.step import fewer_triangles, save_step, triangle_shapes
from touchatlas.sim import make_object

NOISE, TOLERANCE = 0.02, 0.2


def known(name: str, touches: int) -> Atlas:
    """An atlas that knows a body as one face."""
    samples = samples_of_touches(touched_mesh(name, touches, NOISE), 1.5 * NOISE)
    atlas = Atlas(TOLERANCE)
    atlas.known_body = KnownBody(body=body_of_one(samples))
    return atlas


@pytest.fixture(scope="module")
def whole():
    return known("egg", 30)


@pytest.fixture(scope="module")
def half():
    return known("egg", 3)


def read(gmsh, path):
    """Tags of the faces and of the solids of a STEP file."""
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    return [[tag for _, tag in gmsh.model.getEntities(dimension)] for dimension in (2, 3)]


def test_a_closed_surface_is_one_solid_of_its_volume(whole, gmsh, tmp_path):
    """Faces within half a tolerance lack at most that times the area. The noise, and so the error
    of the body, is a tenth of the tolerance."""
    report = save_step(whole, tmp_path / "a.step")
    assert (report.solids, report.open_shells) == (1, 0)
    faces, solids = read(gmsh, tmp_path / "a.step")
    assert report.faces == report.smooth == len(faces) < 500
    # The integral of (1 - u^2) (1 + u / 5)^2 over -1 to 1 is 4 / 3 times 1.008.
    volume, wanted = gmsh.model.occ.getMass(3, solids[0]), 4.0 / 3.0 * 1.008 * np.pi * HALF.prod()
    area = sum(gmsh.model.occ.getMass(2, face) for face in faces)
    assert volume == pytest.approx(wanted, abs=0.5 * TOLERANCE * area)


def test_an_open_surface_is_an_open_shell(half, gmsh, tmp_path):
    report = save_step(half, tmp_path / "a.step")
    assert report.solids == 0 and report.open_shells >= 1
    assert report.triangles == report.faces and "open" in report.note
    _, solids = read(gmsh, tmp_path / "a.step")
    assert not solids


def test_meshes_of_a_smooth_file_lie_on_the_body(whole, gmsh, tmp_path):
    """gmsh makes a closed mesh of the Euler characteristic of a ball, whose nodes lie on it."""
    report = save_step(whole, tmp_path / "a.step")
    read(gmsh, tmp_path / "a.step")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 2.0)
    gmsh.model.mesh.generate(2)
    points = gmsh.model.mesh.getNodes()[1].reshape(-1, 3)
    off = np.abs(whole.body.field.at(points).distance)
    assert off.max() < 1.2 * report.gap <= 0.6 * TOLERANCE
    counts = [len(gmsh.model.getEntities(dimension)) for dimension in (0, 1, 2)]
    assert counts[0] - counts[1] + counts[2] == 2
    assert 0.0 < np.degrees(report.turn) < 3.0


@pytest.mark.parametrize("which", ["whole", "half"])
def test_equal_atlases_give_equal_bytes_and_print_nothing(which, kernel, tmp_path, capfd, request):
    atlas = request.getfixturevalue(which)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        save_step(atlas, tmp_path / folder / "x.step")
    first, second = ((tmp_path / folder / "x.step").read_bytes() for folder in ("a", "b"))
    assert first == second
    assert capfd.readouterr() == ("", "")


def test_kernel_is_imported_only_when_it_is_needed():
    script = "import sys, touchatlas.atlas.cad.step; sys.exit('OCP' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0


def test_atlas_of_nothing_is_refused(kernel, tmp_path):
    with pytest.raises(ValueError, match="surface"):
        save_step(Atlas(0.1), tmp_path / "a.step")


def test_a_law_without_a_name_in_step_is_written_as_triangles_and_said(
    kernel, tmp_path, monkeypatch
):
    """Half an ellipsoid is a quadric but no cone."""
    body = body_of(samples_of_touches(touched_mesh("dome", 30, 0.0), 1e-3))
    monkeypatch.setattr(Atlas, "body", body)
    report = save_step(Atlas(TOLERANCE), tmp_path / "a.step")
    assert "quadric face, which has no name in STEP" in report.note
    assert report.triangles == report.faces > 0 and report.planes == 0


def test_a_ball_is_one_sphere_and_an_ellipsoid_bezier_faces(kernel, tmp_path):
    """A quadric without edges has no name in STEP, but is smooth."""
    ball = learned(spread_touches(make_object("sphere"), 12), 0.1)
    report = save_step(ball, tmp_path / "ball.step")
    assert (report.faces, report.spheres, report.solids, report.note) == (1, 1, 1, "")
    ellipsoid = known("ellipsoid", 30)
    assert [face.kind for face in ellipsoid.body.faces.faces] == ["quadric"]
    report = save_step(ellipsoid, tmp_path / "ellipsoid.step")
    assert report.faces == report.smooth > 0 and report.solids == 1


def test_half_a_ball_is_no_sphere(kernel, tmp_path):
    """What was not touched may end anywhere."""
    half = learned(spread_touches(make_object("sphere"), 3), 0.1)
    assert [face.kind for face in half.faces().faces] == ["sphere"]
    report = save_step(half, tmp_path / "half.step")
    assert report.spheres == report.solids == 0 and report.triangles == report.faces > 0


def test_what_is_no_atlas_or_path_is_refused_before_anything_is_computed(whole, tmp_path):
    with pytest.raises(ValueError, match=r"got Faces for the atlas; call save_step\(atlas, path\)"):
        save_step(whole.faces(), tmp_path / "x.step")
    with pytest.raises(ValueError, match="got NoneType for the path; give the path of a file"):
        save_step(whole, None)


def test_triangles_of_a_ball_are_few_and_within_the_bound_of_it():
    """Their number is inverse to the sagitta: a factor of five, of which a step of 0.7 may lack.
    The triangles of the ball itself are 0.014 within it."""
    ball, counts = surface_of(trimesh.creation.icosphere(4, RADIUS)), []
    for bound in (0.1, 0.5):
        found = fewer_triangles(ball, bound)
        off = np.linalg.norm(found.vertices[found.faces].mean(axis=1), axis=1) - RADIUS
        assert np.abs(off).max() < bound + 0.014
        assert not len(igl.boundary_facets(found.faces)[0])
        counts.append(len(found.faces))
    assert counts[0] / counts[1] == pytest.approx(5.0, rel=0.5)
    assert counts[0] < 0.5 * len(ball.faces)


def box(is_open: bool) -> trimesh.Trimesh:
    """A box of fine triangles, which may lack its top."""
    out = trimesh.creation.box([40.0, 30.0, 20.0]).subdivide().subdivide().subdivide()
    if is_open:
        out.update_faces(out.triangles_center[:, 2] < 9.9)
        out.remove_unreferenced_vertices()
    return out


def test_sides_of_a_box_are_two_triangles_each_and_a_rim_stays():
    found = fewer_triangles(surface_of(box(is_open=False)), 1e-6)
    assert len(found.faces) == 12
    assert np.abs(found.vertices) == pytest.approx(np.tile([20.0, 15.0, 10.0], (8, 1)), abs=1e-6)
    mesh = box(is_open=True)
    found = fewer_triangles(surface_of(mesh), 1e-6)
    assert len(found.faces) < 0.1 * len(mesh.faces)
    rim = found.vertices[np.unique(igl.boundary_facets(found.faces)[0])]
    assert rim[:, 2] == pytest.approx(10.0, abs=1e-6)


def test_a_closed_body_is_a_solid_of_its_volume_and_an_open_one_a_shell(kernel):
    """Each vertex keeps the face that it was of. Nothing stays nothing."""
    other = box(is_open=True).apply_translation([50.0, 0.0, 0.0])
    whole = surface_of(trimesh.util.concatenate([box(is_open=False), other]))
    whole.patch[whole.vertices[:, 0] > 25.0] = 1
    found = fewer_triangles(whole, 1e-6)
    assert (found.patch == (found.vertices[:, 0] > 25.0)).all()
    shapes = triangle_shapes(found)
    assert [one.is_solid for one in shapes] == [True, False]
    assert volume(shapes[0].shape) == pytest.approx(40.0 * 30.0 * 20.0, rel=1e-6)
    empty = fewer_triangles(whole.only(np.zeros(len(whole.vertices), bool)), 1.0)
    assert not len(empty.faces) and not triangle_shapes(empty)
