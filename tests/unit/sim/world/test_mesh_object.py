"""Meshes as objects: contours on plane sections, contacts, bad files refused in one sentence."""

import warnings

import igl
import numpy as np
import pytest
import trimesh

from touchatlas.patch import ContourEnd
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.world.mesh_file import load_mesh
from touchatlas.sim.world.mesh_object import MeshObject


def ball(scale=1.0):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=scale)
    return MeshObject("ball", np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e4])
def test_contact_meets_the_mesh_in_any_unit(scale):
    obj = ball(scale)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(50, 3))
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        hit = obj.contact(-2 * scale * direction, direction, 4 * scale)
        assert hit is not None
        # Inscribed triangles: within the sagitta of the ball, on the side of the approach.
        assert np.linalg.norm(hit) == pytest.approx(scale, rel=5e-3)
        assert hit @ direction < 0
    assert obj.contact(np.array([3.0, 0, 0]) * scale, np.array([0.0, 0, 1]), scale) is None


def test_contour_lies_on_its_plane_and_on_the_mesh():
    obj = ball()
    start = obj.contact(np.array([0.1, 0.2, 2.0]), np.array([0.0, 0, -1]), 4.0)
    normal = np.array([0.6, 0.0, 0.8])
    ((points, end),) = obj.trace_arms(
        start, normal[None], np.array([[0.0, 1.0, 0.0]]), 0.5, 0.05, np.pi / 2
    )
    assert end is ContourEnd.LENGTH_REACHED and len(points) == 10
    assert np.abs((points - start) @ normal).max() < 1e-12
    distance, _, _ = ClosestPoints(obj.vertices, obj.faces)(points)
    assert distance.max() < 1e-9


@pytest.mark.parametrize("along", ["a side of a triangle", "no side"])
def test_a_contour_from_a_vertex_goes_the_way_that_was_asked(along):
    """The section of a ball's mesh by a plane through a vertex is a polygon about its middle, so
    that it goes on on both sides of the vertex. Steps of 0.05 are a fortieth of the radius."""
    obj, rng = ball(), np.random.default_rng(0)
    for k in range(0, len(obj.vertices), 7):
        start = obj.vertices[k]
        other = obj.faces[(obj.faces == k).any(axis=1)][0]
        across = obj.vertices[other[other != k][0]] if along != "no side" else rng.normal(size=3)
        normal = np.cross(start, across) / np.linalg.norm(np.cross(start, across))
        way = np.cross(normal, start) / np.linalg.norm(start)
        arms = obj.trace_arms(start, np.tile(normal, (2, 1)), np.stack([way, -way]), 0.5, 0.05, 2.0)
        for (points, end), direction in zip(arms, (way, -way), strict=True):
            assert end is ContourEnd.LENGTH_REACHED and len(points) == 10
            assert (np.diff((points - start) @ direction, prepend=0.0) > 0.0).all()


def test_only_a_closed_mesh_has_an_inside():
    obj = ball(1.0)
    half = MeshObject("half", obj.vertices, obj.faces[: len(obj.faces) - 1])
    assert obj.is_inside(np.zeros(3)) and not obj.is_inside(np.array([0.0, -1.2, -1.6]))
    assert not half.closed and not half.is_inside(np.zeros(3))


def test_points_from_which_a_ray_grazes_an_edge_are_outside():
    """A ray toward (0.36, 0.48, 0.8) from each meets a vertical edge of a box from outside."""
    box = trimesh.creation.box((60.0, 40.0, 30.0))
    obj = MeshObject("box", box.vertices, box.faces)
    edge = np.array([30.0, -20.0, 0.0]) + np.linspace(-14.0, 14.0, 200)[:, None] * np.eye(3)[2]
    outside = edge - 25.0 * np.array([0.36, 0.48, 0.8])
    assert not any(obj.is_inside(point) for point in outside)
    inside = np.random.default_rng(0).uniform([-30, -20, -15], [30, 20, 15], (200, 3))
    assert all(obj.is_inside(point) for point in inside)


def test_open_mesh_loses_contact_at_its_rim():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    obj = MeshObject("square", vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    assert not obj.closed
    ((points, end),) = obj.trace_arms(
        np.array([0.5, 0.52, 0.0]), np.array([[0.0, 1, 0]]), np.array([[1.0, 0, 0]]), 2.0, 0.1, 1.0
    )
    assert end is ContourEnd.LOST_CONTACT
    assert points[-1] == pytest.approx([0.9, 0.52, 0.0], abs=0.1001)


def test_a_closed_mesh_in_one_plane_is_refused():
    """A sheet of one side is an open mesh, and is not."""
    mesh = trimesh.creation.box(extents=[3.0, 2.0, 1.0])
    flat = np.asarray(mesh.vertices) * [1.0, 1.0, 0.0]
    with pytest.raises(ValueError, match="plate is a closed mesh in one plane"):
        MeshObject("plate", flat, np.asarray(mesh.faces))
    above = np.asarray(mesh.faces)[mesh.face_normals[:, 2] > 0.5]
    assert not MeshObject("sheet", flat, above).closed


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "triangles|cannot be read"),
        ("OFF\n3 1 0\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "NaN"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n", "no extent"),
        ("this is no mesh", "cannot be read|triangles"),
    ],
)
def test_bad_mesh_files_are_refused_in_one_sentence(tmp_path, text, words):
    path = tmp_path / "bad.off"
    path.write_text(text)
    with pytest.raises(ValueError, match=words) as caught:
        load_mesh(path)
    assert "\n" not in str(caught.value)


def test_a_mesh_that_may_not_be_read_is_not_called_damaged(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "mine.ply").write_text("ply")
    monkeypatch.setattr(trimesh, "load", refuse)
    with pytest.raises(PermissionError):
        load_mesh(tmp_path / "mine.ply")


def test_a_number_that_cannot_be_stored_is_not_replaced_by_another(tmp_path):
    """numpy makes the smallest integer of it, and warns; to users warnings are no errors."""
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\n"
    header += "property float y\nproperty float z\nelement face 1\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    (tmp_path / "nan.ply").write_text(header + "nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with warnings.catch_warnings(), pytest.raises(ValueError, match=r"nan.ply cannot be read"):
        warnings.simplefilter("default")
        load_mesh(tmp_path / "nan.ply")


@pytest.mark.parametrize("scale", [1e-40, 1e-9, 1e-3, 1.0, 1e6, 1e13, 1e40])
def test_equal_vertices_are_merged_in_any_unit(tmp_path, scale):
    """A ball of separate triangles: of a closed one there are two more vertices than half its
    triangles (Euler)."""
    sphere = trimesh.creation.icosphere(subdivisions=2)
    corners = scale * np.asarray(sphere.vertices)[sphere.faces].reshape(-1, 3)
    lines = [f"OFF\n{len(corners)} {len(sphere.faces)} 0"]
    lines += [" ".join(f"{x:.17g}" for x in corner) for corner in corners]
    lines += [f"3 {i} {i + 1} {i + 2}" for i in range(0, len(corners), 3)]
    (tmp_path / "ball.off").write_text("\n".join(lines) + "\n")
    vertices, faces = load_mesh(tmp_path / "ball.off")
    assert len(vertices) == len(sphere.faces) // 2 + 2 and len(faces) == len(sphere.faces)
    assert np.isin(vertices, corners).all()
    assert MeshObject("ball", vertices, faces).closed


@pytest.mark.parametrize("kept", [0.1, 0.3, 0.8])
@pytest.mark.parametrize("ending", ["ply", "stl", "off"])
def test_a_file_that_was_cut_off_is_refused(tmp_path, ending, kept):
    for encoding in ("ascii", "binary") if ending == "ply" else ("",):
        options = {"encoding": encoding} if encoding else {}
        path = tmp_path / f"a.{ending}"
        trimesh.creation.icosphere(subdivisions=2).export(path, **options)
        whole = path.read_bytes()
        path.write_bytes(whole[: int(kept * len(whole))])
        with pytest.raises(ValueError, match="cut off"):
            load_mesh(path)


def merged(*meshes):
    mesh = trimesh.util.concatenate(meshes)
    mesh.merge_vertices()
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_mixed_winding_is_mended_and_said():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=10.0)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    faces[::3] = faces[::3, ::-1]
    obj = MeshObject("mixed", vertices, faces)
    assert obj.closed and "wound in different directions" in obj.notes[0] and len(obj.notes) == 1
    normals = igl.per_face_normals(obj.vertices, obj.faces, np.zeros(3))
    centres = obj.vertices[obj.faces].mean(axis=1)
    assert ((normals * centres).sum(axis=1) > 0.0).all()


def test_boxes_that_share_an_edge_are_closed_and_the_edge_is_said():
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    other = box.copy()
    other.apply_translation([10.0, 10.0, 0.0])
    obj = MeshObject("boxes", *merged(box, other))
    assert obj.closed
    assert obj.notes == [
        "boxes has edges where more than two triangles meet (1); contours that cross one may go on "
        "along the wrong triangle"
    ]


def test_an_open_mesh_says_how_many_edges_are_open():
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    vertices, faces = merged(box)
    obj = MeshObject("box", vertices, faces[1:])
    assert not obj.closed and "edges with one triangle only: 3" in obj.notes[0]


def test_a_moebius_strip_has_one_side():
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    rim = [
        np.stack(
            [
                (10.0 + s * np.cos(angle / 2)) * np.cos(angle),
                (10.0 + s * np.cos(angle / 2)) * np.sin(angle),
                s * np.sin(angle / 2),
            ],
            axis=1,
        )
        for s in (-2.0, 2.0)
    ]
    k = np.arange(40)
    following, crossed = (k + 1) % 40, k == 39
    low, high = k, k + 40
    next_low = np.where(crossed, following + 40, following)
    next_high = np.where(crossed, following, following + 40)
    faces = np.concatenate(
        [np.stack([low, next_low, high], axis=1), np.stack([next_low, next_high, high], axis=1)]
    )
    obj = MeshObject("strip", np.concatenate(rim), faces)
    assert any("one side only" in note for note in obj.notes)
