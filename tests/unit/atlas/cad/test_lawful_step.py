"""STEP files of touched bodies whose faces obey laws, read back by another program."""

from collections import Counter
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import body_of, samples_of_touches, touched_mesh
from tests.lawful_meshes import lawful_object
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.cad.lawful import LawfulOptions
from touchatlas.atlas.cad.step import save_step
from touchatlas.atlas.records.options import AtlasOptions

pytestmark = pytest.mark.usefixtures("kernel")
NOISE, TOLERANCE = 0.02, 0.2
# Touches after which a body is closed.
TOUCHES = {"box": 60, "cut ball": 15, "bend": 30, "frustum": 20}
FACES = {
    "box": {"Plane": 6},
    "cut ball": {"Plane": 1, "Sphere": 1},
    "bend": {"Plane": 2, "Cylinder": 2, "Torus": 1},
    "frustum": {"Plane": 2, "Cone": 1},
}
# Faces of bodies with blunt edges, and the number of those that are fillets.
ROUNDED = {
    "rounded": ({"Plane": 6, "Cylinder": 12, "Sphere": 8}, 20),
    "filleted": ({"Plane": 8, "Cylinder": 1}, 1),
}


@lru_cache
def atlas_of(name: str, touches: int, scale: float = 1.0, **options) -> Atlas:
    """An atlas that knows the faces of a body."""
    samples = samples_of_touches(touched_mesh(name, touches, NOISE), 1.5 * NOISE, scale=scale)
    atlas = Atlas(scale * TOLERANCE, AtlasOptions(**options))
    body = body_of(samples)
    atlas.known_body = KnownBody(faces=body.faces, body=body)
    return atlas


def read(gmsh, path):
    """Faces by type, and the volumes of solids."""
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    faces = Counter(gmsh.model.getType(2, tag) for _, tag in gmsh.model.getEntities(2))
    return dict(faces), [gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3)]


def volume_of(name):
    """The volume of a body, within a tenth of the noise times its area."""
    mesh = lawful_object(name)
    triangles = mesh.vertices[mesh.faces]
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1).sum()
    return pytest.approx([(triangles[:, 0] * across).sum() / 6.0], abs=0.1 * NOISE * area)


@pytest.mark.parametrize("name", TOUCHES)
def test_each_lawful_face_is_one_face_of_one_solid(name, gmsh, tmp_path):
    """The volume is the body's to a tenth of the noise times the area: hundreds of samples show
    the level of each face."""
    report = save_step(atlas_of(name, TOUCHES[name]), tmp_path / "a.step")
    assert (report.solids, report.open_shells, report.triangles, report.note) == (1, 0, 0, "")
    kinds = [report.planes, report.cylinders, report.spheres, report.tori]
    assert kinds == [FACES[name].get(kind, 0) for kind in ("Plane", "Cylinder", "Sphere", "Torus")]
    assert report.gap < 0.01 * TOLERANCE
    faces, volumes = read(gmsh, tmp_path / "a.step")
    assert faces == FACES[name]
    assert volumes == volume_of(name)


@pytest.mark.parametrize("name", ROUNDED)
def test_blunt_edges_are_fillets(name, gmsh, tmp_path):
    """Convex edges with their corners, and a concave edge that ends at two planes. With sharp ones
    the volumes would differ by twice the noise times the area, and by three tenths of it."""
    report = save_step(atlas_of(name, 100, facets=1.0), tmp_path / "a.step")
    faces, fillets = ROUNDED[name]
    assert (report.planes, report.cylinders, report.fillets) == (faces["Plane"], 0, fillets)
    assert (report.faces, report.solids, report.note) == (sum(faces.values()), 1, "")
    assert report.gap < 0.01 * TOLERANCE
    assert b"'fillet, radius " in (tmp_path / "a.step").read_bytes()
    found, volumes = read(gmsh, tmp_path / "a.step")
    assert found == faces
    assert volumes == volume_of(name)


def test_the_file_does_not_depend_on_the_unit(gmsh, tmp_path):
    """Equal bodies but for rounding, which fits enlarge from 1e-16 to 1e-9. A body of 0.04 is less
    than a million of the lengths, 1e-7, that the kernel takes for nothing."""
    scale = 1e-3
    one, other = (atlas_of("cut ball", TOUCHES["cut ball"], s) for s in (1.0, scale))
    save_step(one, tmp_path / "a.step")
    save_step(other, tmp_path / "b.step")
    _, volumes = read(gmsh, tmp_path / "a.step")
    gmsh.clear()
    faces, scaled = read(gmsh, tmp_path / "b.step")
    assert faces == FACES["cut ball"]
    assert np.array(scaled) / scale**3 == pytest.approx(volumes, rel=1e-6)


def test_a_body_that_is_known_in_part_is_written_as_triangles(gmsh, tmp_path):
    """Of a box one corner of the top was not touched: its planes close it if they may."""
    columns = touched_mesh("box", 60, NOISE)
    x, y, z = columns[0].T
    samples = samples_of_touches(columns, 1.5 * NOISE, (x < 0.0) | (y < -5.0) | (z < 14.0))
    atlas, body = Atlas(TOLERANCE), body_of(samples)
    atlas.known_body = KnownBody(faces=body.faces, body=body)
    report = save_step(atlas, tmp_path / "a.step")
    assert (report.solids, report.planes) == (0, 0) and report.triangles > 0
    assert "of the surface of the solid is unknown" in report.note
    _, volumes = read(gmsh, tmp_path / "a.step")
    assert not volumes
    report = save_step(atlas, tmp_path / "b.step", LawfulOptions(unknown=0.2))
    assert (report.solids, report.planes, report.triangles) == (1, 6, 0)


def test_planes_that_nearly_meet_in_a_point_have_one_corner(tmp_path):
    """Four planes of a pyramid intersect in two points, less than a tolerance apart."""
    report = save_step(atlas_of("pyramid", 100), tmp_path / "a.step")
    assert (report.planes, report.solids, report.note) == (5, 1, "")
    assert 0.01 * TOLERANCE < report.gap < 0.5 * TOLERANCE
    text = (tmp_path / "a.step").read_bytes()
    assert (text.count(b"VERTEX_POINT("), text.count(b"EDGE_CURVE(")) == (5, 8)


def test_faces_beside_smooth_rims_are_tangent_in_the_file(gmsh, tmp_path):
    """Two half cylinders and the planes between them."""
    report = save_step(atlas_of("stadium", 100), tmp_path / "a.step")
    assert (report.planes, report.cylinders, report.solids, report.note) == (4, 2, 1, "")
    assert report.gap < 0.01 * TOLERANCE
    faces, volumes = read(gmsh, tmp_path / "a.step")
    assert faces == {"Plane": 4, "Cylinder": 2}
    assert volumes == volume_of("stadium")


def test_equal_bodies_give_equal_bytes_that_name_the_faces(tmp_path, capfd):
    atlas = atlas_of("cut ball", TOUCHES["cut ball"])
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        save_step(atlas, tmp_path / folder / "x.step")
    first, second = ((tmp_path / folder / "x.step").read_bytes() for folder in ("a", "b"))
    assert first == second
    assert b"'sphere, radius " in first and b"+-" in first and b"'plane, normal" in first
    assert b"SPHERICAL_SURFACE" in first and b"CIRCLE" in first
    assert capfd.readouterr() == ("", "")
