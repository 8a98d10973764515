"""The judge against pairs whose distances are known in closed form."""

import time

import igl
import numpy as np
import pytest
import trimesh

from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.judge.truth import EvaluateOptions, truth_from_mesh

FEW = EvaluateOptions(samples=4000)


def ball(radius, subdivisions=5):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def judge(surface, truth, tolerance, **more):
    rng = np.random.default_rng(0)
    return evaluate_surface(
        *surface, truth_from_mesh(*truth, rng, FEW), tolerance, rng, options=FEW, **more
    )


def test_a_mesh_is_itself():
    found = judge(ball(2.0), ball(2.0), 0.01)
    # Closest points of points on the triangles: rounding only.
    assert found.hausdorff < 1e-12
    assert found.coverage == found.f_score == 1.0
    assert found.watertight and found.euler_characteristic == 2
    assert found.true_euler_characteristic == 2
    assert found.diagonal == pytest.approx(np.sqrt(48.0), rel=1e-3)
    assert found.as_dict()["met"] is True and found.as_dict()["warnings"] == []


def test_concentric_balls_are_apart_by_the_difference_of_radii():
    found = judge(ball(2.1), ball(2.0), 0.04)
    # Chords of an icosphere of 5 subdivisions, edge 2.1 * 0.04: sagitta edge^2 / (8 r).
    sagitta = (2.1 * 0.045) ** 2 / (8 * 2.0)
    for value in (found.accuracy_mean, found.completeness_mean, found.hausdorff, found.chamfer):
        assert value == pytest.approx(0.1, abs=2 * sagitta)
    assert found.coverage == 0.0 and found.f_score == 0.0
    assert found.normal_error_deg_mean < 2.0
    # Normals are compared where the truth is covered alone.
    none = judge(ball(2.1), ball(2.0), 0.03)
    assert none.coverage == 0.0
    assert none.normal_error_deg_mean is None and none.normal_error_deg_p95 is None


def test_shifted_plates_are_apart_by_the_shift():
    square = (
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    found = judge((square[0] + [0, 0, 0.25], square[1]), square, 0.1)
    for name in ("mean", "rms", "p95", "max"):
        assert getattr(found, f"accuracy_{name}") == pytest.approx(0.25, abs=1e-12)
        assert getattr(found, f"completeness_{name}") == pytest.approx(0.25, abs=1e-12)
    assert found.normal_error_deg_p95 == pytest.approx(0.0, abs=1e-5)
    assert not found.watertight and found.true_euler_characteristic is None


def test_half_a_ball_covers_half():
    vertices, faces = ball(1.0)
    upper = faces[vertices[faces][:, :, 2].mean(axis=1) > 0]
    found = judge((vertices, upper), (vertices, faces), 1e-4)
    # Binomial error of 4000 samples, 4 deviations, and the 3e-4 band at the rim.
    assert found.coverage == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(4000) + 0.01)
    assert found.accuracy_max < 1e-12
    assert not found.watertight
    # The lower half has no surface whose normal could be compared. Those of the truth are of its
    # triangles, which turn by 2.5 degrees from one to the next.
    assert found.normal_error_deg_mean < 2.0
    missing = f"{1.0 - found.coverage:.1%} of the true surface is farther than the tolerance"
    numbers = found.as_dict()
    assert numbers["warnings"] == [missing] and numbers["met"] is False


def test_the_places_of_the_largest_errors_are_where_surface_or_truth_stick_out():
    vertices, faces = ball(1.0, 4)
    bent = vertices.copy()
    bent[vertices[:, 2].argmax(), 2] += 0.5
    false = judge((bent, faces), (vertices, faces), 0.01)
    lacking = judge((vertices, faces), (bent, faces), 0.01)
    assert false.accuracy_max > 0.2 and lacking.completeness_max > 0.2
    assert false.accuracy_max_place[2] == pytest.approx(1.0 + false.accuracy_max, abs=0.02)
    place = lacking.completeness_max_place
    assert place[2] == pytest.approx(1.0 + lacking.completeness_max, abs=0.02)


def egg(radius: float):
    """A stretched ball, whose largest distance from a ball is at one place."""
    vertices, faces = ball(radius, 3)
    return vertices * [1.0, 1.02, 1.05] + [0.0, 0.0, 0.01 * radius], faces


def test_scaling_all_input_scales_all_lengths():
    one = judge(egg(2.1), ball(2.0, 3), 0.04)
    ten = judge(egg(21.0), ball(20.0, 3), 0.4)
    for name, value in one.as_dict().items():
        other = getattr(ten, name)
        lengths = ("tolerance", "diagonal", "chamfer", "hausdorff")
        if name in lengths or name.startswith(("accuracy", "completeness")):
            assert other == pytest.approx(10 * np.array(value), rel=1e-9), name
        elif isinstance(value, float):
            assert other == pytest.approx(value, rel=1e-9), name
        else:
            assert other == value, name


def test_calibration_is_of_the_known_surface_and_coverage_says_what_is_not_reached():
    """The upper half, as exact as it says, with the lower one missing: calibrated, half covered.
    The tolerance is four deviations."""
    rng = np.random.default_rng(1)
    vertices, faces = ball(2.0, 5)
    noisy = vertices * (1.0 + 0.005 * rng.normal(size=(len(vertices), 1)))
    upper = faces[(vertices[faces][:, :, 2] > 0.0).all(axis=1)]
    found = judge((noisy, upper), ball(2.0, 5), 0.04, deviation=np.full(len(vertices), 0.01))
    # Errors within triangles are means of those of their vertices, so they are smaller.
    assert found.deviation_calibration > 0.95
    assert found.coverage == pytest.approx(0.5, abs=0.03)


def test_parts_of_the_truth_that_nothing_reached_are_counted():
    one, other = ball(1.0, 3), ball(1.0, 3)
    both = (
        np.concatenate([one[0], other[0] + [5.0, 0.0, 0.0]]),
        np.concatenate([one[1], other[1] + len(one[0])]),
    )
    found = judge(one, both, 0.01)
    assert (found.components, found.components_reached) == (2, 1)
    assert found.coverage == pytest.approx(0.5, abs=0.01)
    assert judge(both, both, 0.01).components_reached == 2


def test_a_tiny_surface_at_the_centre_of_a_ball_is_judged_at_once():
    """All triangles of the ball are equally far: a tree of boxes leaves none of them out."""
    start = time.monotonic()
    found = judge(ball(1e-3, 5), ball(1.0, 7), 0.01)
    assert time.monotonic() - start < 20.0
    # What is estimated is less than 1 % too far.
    assert found.accuracy_mean == pytest.approx(1.0, rel=0.01)


def test_estimated_distances_are_taken_only_where_most_of_a_mesh_is_equally_far():
    vertices, faces = ball(1.0, 4)
    points = np.random.default_rng(0).normal(size=(3000, 3))
    distance, index, feet = ClosestPoints(vertices, faces)(points)
    square, _, _ = igl.point_mesh_squared_distance(points, vertices, faces)
    # At half a radius from the ball, 1 % of the distance is a cap of less than half a percent.
    near = np.abs(np.linalg.norm(points, axis=1) - 1.0) < 0.5
    assert near.sum() > 1000 and (distance[near] == np.sqrt(square)[near]).all()
    assert distance == pytest.approx(np.sqrt(square), rel=0.01)
    assert np.linalg.norm(points - feet, axis=1) == pytest.approx(distance, abs=1e-9)
    weights = igl.barycentric_coordinates(feet, *vertices[faces[index]].transpose(1, 0, 2))
    assert (weights > -1e-6).all()


def test_calibration_counts_errors_within_the_predicted_interval():
    vertices, faces = ball(2.1)
    sure = judge((vertices, faces), ball(2.0), 0.1, deviation=np.full(len(vertices), 0.01))
    unsure = judge((vertices, faces), ball(2.0), 0.1, deviation=np.full(len(vertices), 0.1))
    assert sure.deviation_calibration == 0.0 and unsure.deviation_calibration == 1.0


@pytest.mark.parametrize(
    ("surface", "tolerance", "words"),
    [
        ((np.zeros((3, 3)), np.zeros((0, 3), int)), 0.1, "no triangles"),
        ((np.full((3, 3), np.nan), np.array([[0, 1, 2]])), 0.1, "NaN"),
        ((np.eye(3), np.array([[0, 1, 7]])), 0.1, "does not have"),
        ((np.eye(3)[:, :2], np.array([[0, 1, 2]])), 0.1, "shape"),
        ((np.eye(3), np.array([[0, 1, 2]])), -1.0, "tolerance is -1"),
        ((np.eye(3), np.array([[0.0, 1.0, 2.4]])), 0.1, "float64"),
        ((np.ones((3, 3)), np.array([[0, 1, 2]])), 0.1, "no area"),
    ],
)
def test_what_is_no_surface_is_refused(surface, tolerance, words):
    with pytest.raises(ValueError, match=words):
        judge(surface, ball(1.0, 2), tolerance)


def test_a_torus_has_euler_characteristic_zero_and_two_balls_four():
    torus = trimesh.creation.torus(2.0, 0.5)
    surface = (np.asarray(torus.vertices), np.asarray(torus.faces))
    found = judge(surface, surface, 0.01)
    assert found.watertight and found.euler_characteristic == found.true_euler_characteristic == 0
    vertices, faces = ball(0.2, 2)
    two = np.concatenate([vertices, vertices + 1.0]), np.concatenate([faces, faces + len(vertices)])
    assert judge(two, surface, 0.01).euler_characteristic == 4


def test_one_face_turned_inside_out_is_not_watertight():
    vertices, faces = ball(1.0, 2)
    turned = faces.copy()
    turned[7] = turned[7, ::-1]
    assert not judge((vertices, turned), (vertices, faces), 0.1).watertight


def test_a_surface_inside_out_has_normals_the_other_way():
    vertices, faces = ball(1.0, 4)
    right = judge((vertices, faces), (vertices, faces), 0.1).normal_error_deg_mean
    wrong = judge((vertices, faces[:, ::-1]), (vertices, faces), 0.1).normal_error_deg_mean
    # The same points and angles, seen from the other side.
    assert wrong == pytest.approx(180.0 - right, abs=1e-9)


def test_moving_both_leaves_every_number():
    surface, truth = egg(2.1), ball(2.0, 3)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    still = judge(surface, truth, 0.04).as_dict()
    moved = judge(
        *[(vertices @ turn.T + [5.0, -3.0, 1.0], faces) for vertices, faces in (surface, truth)],
        0.04,
    ).as_dict()
    # The bounding box does not turn with the body, and no deviation was given.
    for numbers in (still, moved):
        del numbers["diagonal"], numbers["deviation_calibration"]
    assert moved.pop("warnings") == still.pop("warnings")
    for name in ("accuracy_max_place", "completeness_max_place"):
        place = turn @ still.pop(name) + [5.0, -3.0, 1.0]
        assert moved.pop(name) == pytest.approx(place, rel=1e-7, abs=1e-9)
    assert moved == pytest.approx(still, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(
    ("deviation", "words"),
    [(np.ones(3), "shape"), (np.full(162, np.nan), "NaN"), (np.full(162, -1.0), "negative")],
)
def test_a_deviation_that_is_none_is_refused(deviation, words):
    with pytest.raises(ValueError, match=f"deviation .*{words}"):
        judge(ball(1.0, 2), ball(1.0, 2), 0.1, deviation=deviation)


def test_a_judgement_of_no_samples_is_refused():
    with pytest.raises(ValueError, match="samples is 0"):
        EvaluateOptions(samples=0)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_deviation_comes_back_with_its_own_vertex_in_any_encoding(tmp_path, encoding):
    vertices, faces = ball(1.0, 2)
    # Two vertices at one place, and one that no face uses, must not shift the rest.
    vertices = np.concatenate([vertices, vertices[:1], [[0.0, 0.0, 9.0]]])
    faces = np.where((faces == 0) & (np.arange(len(faces)) == 0)[:, None], len(vertices) - 2, faces)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.vertex_attributes["deviation"] = vertices[:, 2] + 2.0
    mesh.export(tmp_path / "s.ply", encoding=encoding)
    points, found_faces, deviation, _ = load_surface(tmp_path / "s.ply")
    assert (found_faces == faces).all()
    # trimesh writes the coordinates in single, the attribute in double precision.
    assert deviation == pytest.approx(points[:, 2] + 2.0, abs=1e-6)


def test_any_other_file_is_read_without_deviation_and_closed_again(tmp_path):
    vertices, faces = ball(1.0, 2)
    trimesh.Trimesh(vertices, faces).export(tmp_path / "s.stl")
    points, triangles, deviation, _ = load_surface(tmp_path / "s.stl")
    assert deviation is None
    assert judge((points, triangles), (vertices, faces), 0.1).watertight
