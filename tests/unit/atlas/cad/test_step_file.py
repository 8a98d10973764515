"""STEP files, read back by another program: gmsh, with its own build of the CAD kernel."""

import subprocess
import sys

import numpy as np
import pytest

from tests.explored import explored
from tests.lawful import body_of, samples_of_touches, touched_mesh
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.cad.bezier import bernstein
from touchatlas.atlas.cad.bezier_face import bezier_face
from touchatlas.atlas.cad.step_file import save_step
from touchatlas.atlas.cad.trimmed_patches import trimmed_patches
from touchatlas.patch.geometry.polynomial import shape_operator

RADIUS = 33.0
ORIGIN = np.zeros((1, 2))


@pytest.fixture(scope="module")
def ball():
    return explored("sphere").atlas


@pytest.fixture(scope="module")
def half():
    atlas = explored("sphere", max_touches=25).atlas
    atlas.refit_all()
    return atlas


@pytest.fixture
def kernel():
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")


@pytest.fixture
def gmsh(kernel):
    """gmsh, started; its wheel needs libraries of X that a bare system lacks."""
    module = pytest.importorskip("gmsh", reason="needs gmsh", exc_type=(ImportError, OSError))
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


def read(gmsh, path):
    """Tags of the faces and of the solids of a STEP file."""
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    return [[tag for _, tag in gmsh.model.getEntities(dimension)] for dimension in (2, 3)]


def test_bezier_face_goes_through_its_sides_as_near_as_the_patches_are(ball):
    """A side is midway between two patches: half their gap off each, and the heights hold to
    1e-5 besides. The gap of the ball's patches is nowhere a quarter of the tolerance."""
    for face in trimmed_patches(ball)[:20]:
        bezier = bezier_face(face, 1e-4 * ball.tolerance)
        assert bezier.error <= 1e-4 * ball.tolerance
        assert bezier.gaps.max() < 0.25 * ball.tolerance
        degree = len(bezier.poles) - 1
        for side, trace in zip(face.sides, bezier.traces, strict=True):
            u, v = trace[0]
            point = bernstein(degree, [u])[0] @ np.tensordot(
                bernstein(degree, [v])[0], bezier.poles, axes=(0, 1)
            )
            assert np.linalg.norm(point - side.points[0]) <= bezier.gaps.max()


@pytest.mark.parametrize("which", ["ball", "half"])
def test_other_programs_find_the_same_areas(which, request, gmsh, tmp_path):
    """Each face's area: heights are off by 1e-4 tolerances, 1e-5, over faces 10 wide that are
    inclined by up to 0.5, so areas by less than 1e-6; feet of the sides, by the square of the
    gap times the curvature, 0.01^2/33, are less."""
    atlas = request.getfixturevalue(which)
    report = save_step(atlas, tmp_path / "a.step")
    faces = trimmed_patches(atlas)
    tags, _ = read(gmsh, tmp_path / "a.step")
    areas = np.array([gmsh.model.occ.getMass(2, tag) for tag in tags])
    assert report.faces == len(tags) == len(faces) and report.left_out == 0
    assert areas == pytest.approx(np.array([face.area for face in faces]), rel=2e-6)


def test_closed_atlas_is_one_solid_of_the_balls_volume(ball, gmsh, tmp_path):
    """Three times the mean radial error, 0.002, over the radius."""
    report = save_step(ball, tmp_path / "a.step")
    assert (report.solids, report.open_shells) == (1, 0)
    _, solids = read(gmsh, tmp_path / "a.step")
    assert len(solids) == 1
    volume = gmsh.model.occ.getMass(3, solids[0])
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS**3, rel=2e-4)
    # The ball's sides and corners, each once.
    counts = [len(gmsh.model.getEntities(dimension)) for dimension in (1, 0)]
    assert counts == [ball.graph.number_of_edges(), len(ball.corners)]


def test_other_programs_find_the_same_curvatures_and_normals(ball, gmsh, tmp_path):
    """At the foot of each patch's origin, against the polynomial's own shape operator.

    A height off by e within a cell of half-width L is off in its second derivative by some
    e d^2/L^2: 1e-5 * 36/7^2, 7e-6, of a curvature of 0.03.
    """
    save_step(ball, tmp_path / "a.step")
    tags, _ = read(gmsh, tmp_path / "a.step")
    for face, tag in zip(trimmed_patches(ball), tags, strict=True):
        polynomial, frame = face.patch.polynomial, face.patch.frame
        slope, second = polynomial.gradient(ORIGIN)[0], polynomial.hessian(ORIGIN)[0]
        point = frame.to_world(np.append(ORIGIN, polynomial.height(ORIGIN))[None])[0]
        at = gmsh.model.getParametrization(2, tag, point.tolist())
        found = np.concatenate(gmsh.model.getPrincipalCurvatures(tag, at)[:2])
        wanted = np.sort(np.linalg.eigvals(shape_operator(*slope, *second)))
        assert np.sort(found) == pytest.approx(wanted, abs=1e-5)
        normal = np.array(gmsh.model.getNormal(tag, at))
        assert normal @ face.patch.normal(point[None])[0] == pytest.approx(1.0, abs=1e-8)


def test_open_atlas_is_an_open_shell(half, gmsh, tmp_path):
    report = save_step(half, tmp_path / "a.step")
    assert report.solids == 0 and report.open_shells >= 1
    _, solids = read(gmsh, tmp_path / "a.step")
    assert not solids


def test_equal_atlases_give_equal_bytes_and_print_nothing(half, kernel, tmp_path, capfd):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        save_step(half, tmp_path / folder / "x.step")
    first, second = ((tmp_path / folder / "x.step").read_bytes() for folder in ("a", "b"))
    assert first == second
    assert capfd.readouterr() == ("", "")


def test_failed_write_leaves_the_old_file(half, kernel, tmp_path, monkeypatch):
    path = tmp_path / "a.step"
    path.write_text("old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        save_step(half, path)
    assert path.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["a.step"]


def test_missing_extra_is_named(half, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "OCP", None)
    monkeypatch.delitem(sys.modules, "OCP.STEPControl", raising=False)
    with pytest.raises(ValueError, match=r"pip install touchatlas\[cad\]"):
        save_step(half, tmp_path / "a.step")
    assert not list(tmp_path.iterdir())


def test_kernel_is_imported_only_when_it_is_needed():
    script = "import sys, touchatlas.atlas.cad.step_file; sys.exit('OCP' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0


def test_atlas_of_nothing_is_refused(kernel, tmp_path):
    with pytest.raises(ValueError, match="no patch yet"):
        save_step(Atlas(0.1), tmp_path / "a.step")


def test_a_law_without_a_name_in_step_is_written_as_triangles_and_said(
    half, kernel, tmp_path, monkeypatch
):
    """An ellipsoid is a quadric but no cone."""
    body = body_of(samples_of_touches(touched_mesh("ellipsoid", 10, 0.0), 1e-3))
    monkeypatch.setattr(Atlas, "body", body)
    report = save_step(half, tmp_path / "a.step")
    assert "quadric face, which has no name in STEP" in report.note
    assert report.triangles == report.faces > 0 and report.planes == report.patches == 0
