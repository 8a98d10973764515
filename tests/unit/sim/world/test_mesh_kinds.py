"""Meshes as people have them: polygons, several bodies, doubled faces, inside-out parts, units."""

from zipfile import ZipFile

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.cad.kernel import silence
from touchatlas.sim import make_object
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.judge.truth import truth_from_mesh
from touchatlas.sim.run.conclusion import truth_of
from touchatlas.sim.world.mesh_file import read_mesh
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.step_file import load_step

# An L of area 300 in a square of 20, and 5 high.
L = [[20, 10], [10, 10], [10, 20], [0, 20], [0, 0], [20, 0]]
CORNERS = [[x, y, z] for z in (0, 5) for x, y in L]
WALLS = [[i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i] for i in range(6)]


def polygons(start):
    """Faces of the prism; the concave ones begin at a corner."""
    bottom = [(start - i) % 6 for i in range(6)]
    return [bottom, [6 + (start + i) % 6 for i in range(6)], *WALLS]


def write_ply(path, faces, binary, order="<"):
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[order] if binary else "ascii"
    header = f"ply\nformat {kind} 1.0\nelement vertex {len(CORNERS)}\nproperty float x\n"
    header += f"property float y\nproperty float z\nelement face {len(faces)}\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    if binary:
        body = np.array(CORNERS, f"{order}f4").tobytes()
        body += b"".join(bytes([len(f)]) + np.array(f, f"{order}i4").tobytes() for f in faces)
    else:
        lines = [*CORNERS, *([len(f), *f] for f in faces)]
        body = "\n".join(" ".join(map(str, line)) for line in lines).encode() + b"\n"
    path.write_bytes(header.encode() + body)


@pytest.mark.parametrize("kind", ["text.ply", "little.ply", "big.ply", "a.obj", "a.off"])
@pytest.mark.parametrize("start", range(6))
def test_concave_polygons_are_cut_inside_of_them(tmp_path, kind, start):
    path, faces = tmp_path / kind, polygons(start)
    if path.suffix == ".ply":
        write_ply(path, faces, kind != "text.ply", ">" if kind == "big.ply" else "<")
    elif path.suffix == ".obj":
        lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
        # A long line goes on after a backslash, and may end in a comment.
        words = [[f"{i + 1}" for i in face] for face in faces]
        lines += [f"f {' '.join(f[:5])} \\\n{' '.join(f[5:])} # face" for f in words]
        path.write_text("\n".join(lines) + "\n")
    else:
        lines = ["OFF", f"{len(CORNERS)} {len(faces)} 0", *(f"{x} {y} {z}" for x, y, z in CORNERS)]
        lines += [f"{len(face)} " + " ".join(map(str, face)) for face in faces]
        path.write_text("\n".join(lines) + "\n")
    found = trimesh.Trimesh(*read_mesh(path)[:2], process=False)
    # 2 x 300, and a rim of 80 that is 5 high.
    assert found.is_watertight and found.area == pytest.approx(1000.0, rel=1e-12)
    assert found.volume == pytest.approx(1500.0, rel=1e-12)


def test_binary_ply_files_of_unlike_faces_are_read(tmp_path):
    write_ply(
        tmp_path / "m.ply",
        [
            *polygons(4)[:2],
            *WALLS[:3],
            *([w[i] for i in t] for w in WALLS[3:] for t in ((0, 1, 2), (0, 2, 3))),
        ],
        True,
    )
    assert make_object(str(tmp_path / "m.ply")).area == pytest.approx(1000.0, rel=1e-6)
    whole = (tmp_path / "m.ply").read_bytes()
    (tmp_path / "cut.ply").write_bytes(whole[:-40])
    with pytest.raises(ValueError, match="cut off"):
        read_mesh(tmp_path / "cut.ply")


def test_a_binary_stl_that_goes_on_after_its_last_triangle_is_read(tmp_path):
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    box.export(tmp_path / "a.stl")
    (tmp_path / "b.stl").write_bytes((tmp_path / "a.stl").read_bytes() + b"colour of the part" * 3)
    assert make_object(str(tmp_path / "b.stl")).area == pytest.approx(22.0)


def bodies(*parts):
    mesh = trimesh.util.concatenate(list(parts))
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def box(side=2.0, x=0.0, turned=False):
    body = trimesh.creation.box((side,) * 3).apply_translation([x, 0.0, 0.0])
    if turned:
        body.invert()
    return body


def coarse_ball():
    return trimesh.creation.icosphere(subdivisions=1, radius=3.0)


def twice_opposed():
    vertices, faces = bodies(box())
    return trimesh.Trimesh(vertices, np.concatenate([faces, faces[:, ::-1]]), process=False)


def spike():
    """A square with a needle of a thousandth of its side that stands up by five sides."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0, 5], [0.501, 0, 0]]
    return trimesh.Trimesh(corners, [[0, 5, 2], [5, 1, 2], [0, 2, 3], [0, 4, 5]], process=False)


KINDS = {
    "several bodies": lambda: trimesh.Trimesh(*bodies(box(), box(x=9.0)), process=False),
    "a tiny body": lambda: trimesh.Trimesh(*bodies(box(40.0), box(0.01, 50.0)), process=False),
    "a body inside out": lambda: trimesh.Trimesh(*bodies(box(), box(x=9.0, turned=True))),
    "all inside out": lambda: box(turned=True),
    "overlapping": lambda: trimesh.Trimesh(*bodies(box(), box(1.0, 1.0)), process=False),
    "a cavity": lambda: trimesh.Trimesh(*bodies(box(4.0), box(turned=True)), process=False),
    "doubled faces": twice_opposed,
    "a coarse ball": coarse_ball,
    "a needle": spike,
    "far away": lambda: box().apply_translation([1e5, 0, 0]),
}
EXACT = ("accuracy_mean", "accuracy_max", "completeness_p95", "completeness_max", "chamfer")


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_against_itself_is_without_error_in_every_figure(tmp_path, kind):
    KINDS[kind]().export(tmp_path / "m.ply")
    obj = make_object(str(tmp_path / "m.ply"))
    truth = truth_of(obj, obj.tolerance, np.random.default_rng(0))
    vertices, faces, _, notes = load_surface(tmp_path / "m.ply")
    found = evaluate_surface(vertices, faces, truth, obj.tolerance, np.random.default_rng(1))
    assert [getattr(found, name) for name in (*EXACT, "hausdorff")] == [0.0] * 6
    # Normals are interpolated from corners: some last digits.
    assert found.normal_error_deg_mean < 1e-12 and found.normal_error_deg_p95 < 1e-12
    assert found.coverage == 1.0 and found.f_score == 1.0 and found.met
    assert found.components_reached == found.components
    if truth.closed:
        assert found.euler_characteristic == found.true_euler_characteristic
    assert notes == obj.notes or kind == "far away"


def test_each_body_is_turned_outward_and_a_cavity_keeps_to_its_body():
    """Volumes of the mesh as a whole: 8 each; 64 less 8."""
    for parts, volume in (
        ((box(), box(x=9.0, turned=True)), 16.0),
        ((box(turned=True), box(x=9.0, turned=True)), 16.0),
        ((box(4.0), box(turned=True)), 56.0),
        ((box(4.0, turned=True), box()), 56.0),
    ):
        obj = MeshObject("b", *bodies(*parts))
        found = trimesh.Trimesh(obj.vertices, obj.faces, process=False)
        assert found.volume == pytest.approx(volume)


def test_a_wall_that_two_bodies_share_is_left_out():
    """Two tetrahedra on one triangle, of which the others close: six faces, of five vertices."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1.0]])
    faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1], [1, 0, 4], [2, 1, 4], [0, 2, 4], [0, 1, 2]]
    obj = MeshObject("two", corners, np.array(faces))
    assert len(obj.faces) == 6 and obj.closed and obj.euler_characteristic == 2
    assert "walls between bodies" in obj.notes[0]


def test_what_was_changed_is_noted(tmp_path):
    for kind, words in (
        ("doubled faces", "same corners again (12)"),
        ("a body inside out", "there was a body inside out"),
    ):
        KINDS[kind]().export(tmp_path / "m.ply")
        assert any(words in note for note in make_object(str(tmp_path / "m.ply")).notes)
    small = trimesh.creation.box((1e-3, 2e-3, 3e-3)).apply_translation([10.0, 0, 0])
    small.export(tmp_path / "far.stl")
    (note,) = read_mesh(tmp_path / "far.stl").notes
    assert "single precision" in note and "tolerances apart" in note


def test_walls_inside_of_other_bodies_are_not_missed():
    """Of two boxes, of which one sticks out of the other, only the outside can be touched."""
    truth = truth_from_mesh(*bodies(box(), box(1.0, 1.0)), np.random.default_rng(0))
    assert truth.hidden_area == pytest.approx(4.0 / 30.0, abs=0.01)
    found = evaluate_surface(*bodies(box()), truth, 0.6, np.random.default_rng(0))
    # What sticks out by a half is within 0.6 of the box.
    assert found.completeness_max <= 0.6 and found.met


def test_vertices_count_in_maxima():
    """The tip of the needle has no area, and no sample."""
    flat = trimesh.Trimesh(spike().vertices, spike().faces[:3], process=False)
    truth = truth_from_mesh(flat.vertices, flat.faces, np.random.default_rng(0))
    mesh = spike()
    found = evaluate_surface(mesh.vertices, mesh.faces, truth, 0.1, np.random.default_rng(0))
    # A point that is equally far from all triangles is found to 1 %.
    assert found.accuracy_max == found.hausdorff == pytest.approx(5.0, rel=0.01)
    assert found.accuracy_max_place == (0.5, 0.0, 5.0)


@pytest.mark.parametrize(("unit", "edge"), [("millimeter", "mm"), ("inch", "in"), ("meter", "m")])
def test_3mf_files_keep_their_unit(tmp_path, unit, edge):
    pytest.importorskip("lxml")
    box().export(tmp_path / "mm.3mf")
    with ZipFile(tmp_path / "mm.3mf") as old, ZipFile(tmp_path / "b.3mf", "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"millimeter", unit.encode()))
    obj = make_object(str(tmp_path / "b.3mf"))
    assert obj.unit == edge and obj.area == pytest.approx(24.0)


def write_step(path, shape):
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    with silence():
        writer = STEPControl_Writer()
        writer.Transfer(shape.Shape(), STEPControl_AsIs)
        writer.Write(str(path))


def test_triangles_of_a_step_file_are_within_their_bound_of_its_surface(tmp_path):
    """A ball bends in both directions. Means of the three corners lie in the triangles."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    write_step(tmp_path / "ball.step", BRepPrimAPI_MakeSphere(25.0))
    for sagitta in (1e-3, 1e-4):
        vertices, faces, _ = load_step(tmp_path / "ball.step", sagitta)
        inside = 25.0 - np.linalg.norm(vertices[faces].mean(axis=1), axis=1)
        assert 0.0 < inside.max() < sagitta * np.linalg.norm(np.ptp(vertices, axis=0))


@pytest.mark.parametrize(("unit", "millimetres"), [("MM", 1.0), ("M", 1e3), ("INCH", 25.4)])
def test_step_files_are_bodies_in_their_own_unit(tmp_path, unit, millimetres):
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.Interface import Interface_Static

    Interface_Static.SetCVal_s("write.step.unit", unit)
    try:
        write_step(tmp_path / "c.step", BRepPrimAPI_MakeCylinder(10.0, 30.0))
    finally:
        Interface_Static.SetCVal_s("write.step.unit", "MM")
    obj = make_object(str(tmp_path / "c.step"))
    assert obj.unit == {"MM": "mm", "M": "m", "INCH": "in"}[unit] and obj.closed
    # Inside by the sagitta, 1e-4 of the diagonal, of a radius of a quarter of it.
    assert obj.area * millimetres**2 == pytest.approx(2 * np.pi * 10.0 * 40.0, rel=1e-3)
    (tmp_path / "cut.step").write_bytes((tmp_path / "c.step").read_bytes()[:3000])
    with pytest.raises(ValueError, match="damaged, or holds no shape"):
        read_mesh(tmp_path / "cut.step")
