"""Built-in objects against closed forms and finite differences."""

import numpy as np
import pytest
import trimesh

from tests.sharp import sharp_object
from touchatlas.patch import ContourEnd
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object, object_names
from touchatlas.sim.world.probe import Probe

SMOOTH = [name for name in object_names() if name != "cube"]


@pytest.fixture(scope="module")
def samples():
    return {
        name: make_object(name).sample(300, np.random.default_rng(1)) for name in object_names()
    }


@pytest.mark.parametrize("name", object_names())
def test_samples_lie_on_the_surface(name, samples):
    obj = make_object(name)
    points, normals = samples[name]
    value, gradient, _ = obj.field(points)
    distance = np.abs(value) / np.linalg.norm(gradient, axis=1)
    assert distance.max() < 1e-9 * obj.diagonal
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(300), abs=1e-12)


@pytest.mark.parametrize("name", SMOOTH)
def test_gradient_and_hessian_match_finite_differences(name, samples):
    obj = make_object(name)
    points = samples[name][0]
    if name == "plate":
        # Where the box's pieces meet the Hessian jumps: keep clear of it by a step.
        inner = np.abs(np.abs(points) - np.array([45.0, 25.0, 5.0])).min(axis=1)
        points = points[inner > 1e-2]
    h = 1e-5 * obj.diagonal
    _, gradient, hessian = obj.field(points)
    for axis in range(3):
        step = h * np.eye(3)[axis]
        up, down = obj.field(points + step), obj.field(points - step)
        scale = np.abs(gradient).max()
        assert (up[0] - down[0]) / (2 * h) == pytest.approx(gradient[:, axis], abs=1e-5 * scale)
        bend = np.abs(hessian).max()
        assert (up[1] - down[1]) / (2 * h) == pytest.approx(hessian[:, axis], abs=1e-4 * bend)


def test_torus_principal_curvatures_match_closed_form(samples):
    """k = -1/b around the tube, -cos v/(a + b cos v) along it (do Carmo, section 3-3)."""
    points = samples["torus"][0]
    cosine = (np.hypot(points[:, 0], points[:, 1]) - 40.0) / 15.0
    along = -cosine / (40.0 + 15.0 * cosine)
    k1, k2, _ = make_object("torus").principal_curvatures(points)
    assert k1 == pytest.approx(np.maximum(along, -1 / 15.0), abs=1e-9)
    assert k2 == pytest.approx(np.minimum(along, -1 / 15.0), abs=1e-9)


def test_ellipsoid_gaussian_curvature_matches_closed_form(samples):
    """K = 1 / (a b c (x^2/a^4 + y^2/b^4 + z^2/c^4))^2."""
    points = samples["ellipsoid"][0]
    axes = np.array([80.0, 50.0, 30.0])
    k1, k2, directions = make_object("ellipsoid").principal_curvatures(points)
    expected = (axes.prod() * (points**2 / axes**4).sum(axis=1)) ** -2.0
    assert k1 * k2 == pytest.approx(expected, rel=1e-9)
    assert (k1 >= k2).all()
    assert (directions[:, 0] * directions[:, 1]).sum(axis=1) == pytest.approx(
        np.zeros(300), abs=1e-12
    )


def test_bottle_has_a_neck_of_negative_gaussian_curvature(samples):
    k1, k2, _ = make_object("bottle").principal_curvatures(samples["bottle"][0])
    assert ((k1 > 0.005) & (k2 < -0.02)).any()


@pytest.mark.parametrize(
    ("name", "area"), [("sphere", 4 * np.pi * 33**2), ("torus", 4 * np.pi**2 * 600)]
)
def test_area_matches_closed_form(name, area):
    # Inscribed triangles lose about sagitta/r of the area: 0.05 * 0.1 / 15.
    assert make_object(name).area == pytest.approx(area, rel=1e-3)


@pytest.mark.parametrize("name", [*SMOOTH, "cube"])
def test_traced_points_lie_on_surface_and_plane_at_equal_steps(name, samples):
    obj = make_object(name)
    for point, normal in zip(*[a[:5] for a in samples[name]], strict=True):
        along = np.cross(normal, [0.3, 0.5, 0.81])
        along /= np.linalg.norm(along)
        plane = np.cross(along, normal)
        step = 0.005 * obj.diagonal
        ((points, end),) = obj.trace_arms(point, plane[None], along[None], 8 * step, step, 0.8)
        if end is ContourEnd.LENGTH_REACHED:
            assert len(points) == 8
        if not len(points):
            continue
        value, gradient, _ = obj.field(points)
        assert np.abs(value / np.linalg.norm(gradient, axis=1)).max() < 1e-9 * obj.diagonal
        assert np.abs((points - point) @ plane).max() < 1e-9 * obj.diagonal
        chords = np.linalg.norm(np.diff(np.vstack([point, points]), axis=0), axis=1)
        # A chord is shorter than its arc s by s (turn)^2/24, the turn below 0.8 over all.
        assert (chords <= step * (1 + 1e-4)).all() and (chords >= step * (1 - 0.8**2 / 24)).all()


def body_of(name: str, tmp_path):
    """A built-in object, or a mesh of the cube of 60."""
    if name != "box.ply":
        return make_object(name)
    trimesh.creation.box((60.0, 60.0, 60.0)).export(tmp_path / name)
    return make_object(str(tmp_path / name))


RIGHT = 0.5 * np.pi
ENDS = [
    # Over the edge, by steps of 2.3 along the surface: 16 below it, 46 from the start. Chords are
    # shorter by what the curve cuts off at the edge: two 256ths of a step on the cube.
    ("cube", 46.0, 2.3, 2.0, ContourEnd.LENGTH_REACHED, 20, [30.0, 0.0, 14.0]),
    ("box.ply", 46.0, 2.3, 2.0, ContourEnd.LENGTH_REACHED, 20, [30.0, 0.0, 14.0]),
    ("cube", 50.0, 2.3, 0.8, ContourEnd.EDGE, 13, [29.9, 0.0, 30.0]),
    ("sphere", 60.0, 1.0, 0.5 * RIGHT, ContourEnd.TURNED_AWAY, 25, None),
    ("sphere", 300.0, 1.0, 2.0 * RIGHT + 1.0, ContourEnd.CLOSED_LOOP, 206, None),
]


@pytest.mark.parametrize(("name", "reach", "step", "turn", "end", "count", "last"), ENDS)
def test_a_contour_from_the_top_ends_where_it_must(
    name, reach, step, turn, end, count, last, tmp_path
):
    """An eighth of a turn about the ball of radius 33 is 25.9 steps, and a great circle 207.3;
    the last sample of the closed loop lies within a step of the start."""
    obj = body_of(name, tmp_path)
    top = np.array([[0.0, 0.0, 33.0 if name == "sphere" else 30.0]])
    ((points, found),) = obj.trace_arms(top[0], np.eye(3)[1:2], np.eye(3)[:1], reach, step, turn)
    assert found is end and len(points) == pytest.approx(count, abs=end is ContourEnd.CLOSED_LOOP)
    if last is not None:
        assert points[-1] == pytest.approx(last, abs=2.0 * step / 256.0)
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        # All but the one across the edge are whole.
        assert (np.abs(chords - step) < 1e-9).sum() >= len(chords) - 1


@pytest.mark.parametrize("below", [0.34, 3.0])
def test_contour_beside_a_notch_ends_at_the_edge_of_its_face(below):
    """Beyond that edge the wall of the notch, 0.1 away, is nearly upright to the contour's plane:
    Newton's steps on it lead 5 away. So the contour turns by a right angle."""
    step, arc = sharp_object("step"), 1.33
    start, plane = np.array([0.1, -20.0, -below]), np.array([[-1.0, 0.0, 0.02]])
    plane /= np.linalg.norm(plane)
    ((points, end),) = step.trace_arms(start, plane, np.array([[0.0, 0.0, 1.0]]), 16.0, arc, 0.8)
    assert end is ContourEnd.EDGE
    assert len(points) == int(below / arc)
    assert (points[:, 1] == -20.0).all() and (points[:, 2] < 0.0).all()


def test_contact_is_the_first_entry():
    torus = make_object("torus")
    down = np.array([0.0, 0.0, -1.0])
    assert torus.contact(np.array([40.0, 0.0, 60.0]), down, 100.0) == pytest.approx([40, 0, 15])
    assert torus.contact(np.array([0.0, 0.0, 60.0]), down, 100.0) is None
    assert torus.contact(np.array([40.0, 0.0, 60.0]), down, 20.0) is None


def test_a_long_approach_meets_a_thin_body():
    """A 64th of the segment is longer than the disc is thick; beside it, there is nothing."""
    disc = ImplicitObject("disc", "", quadric_with_bumps((60.0, 50.0, 1.0)), (60, 50, 1), 0.02, 0.1)
    down = np.array([0.0, 0.0, -1.0])
    assert disc.contact(np.array([0.0, 0.0, 700.0]), down, 1400.0) == pytest.approx([0, 0, 1])
    assert disc.contact(np.array([0.0, 52.0, 700.0]), down, 1400.0) is None
    assert disc.contact(np.array([0.0, 0.0, -700.0]), down, 1400.0) is None


@pytest.mark.parametrize("noise", [-0.1, np.nan, np.inf])
def test_probe_refuses_a_noise_that_is_none(noise):
    with pytest.raises(ValueError, match="noise is"):
        Probe(make_object("sphere"), noise, np.random.default_rng(0))
