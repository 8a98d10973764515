"""Curves, single points and clouds make an atlas, alone and with touches."""

import numpy as np
import pytest

from touchatlas.atlas import Atlas, Scan, extract_surface, load_atlas, save_atlas
from touchatlas.atlas.samples.neighbourhoods import thinned

AXES = np.array([3.0, 2.0, 1.5])
NOISE, TOLERANCE = 1e-3, 5e-3


def off_ellipsoid(points):
    """First-order distances (n,) from the ellipsoid."""
    square = (points * points / AXES**2).sum(axis=1)
    return (square - 1.0) / (2.0 * np.linalg.norm(points / AXES**2, axis=1))


def cloud(count, noise, seed=0):
    rng = np.random.default_rng(seed)
    sphere = rng.normal(size=(count, 3))
    points = AXES * sphere / np.linalg.norm(sphere, axis=1)[:, None]
    return points + rng.normal(0.0, noise, points.shape)


def rings(levels, count, seed=0):
    """Closed sections at even levels, and the number of each."""
    z, angle = np.repeat(levels, count), np.tile(np.arange(count), len(levels)) * 2 * np.pi / count
    radius = np.sqrt(1.0 - (z / AXES[2]) ** 2)
    points = np.stack([AXES[0] * radius * np.cos(angle), AXES[1] * radius * np.sin(angle), z], 1)
    noise = np.random.default_rng(seed).normal(0.0, NOISE, points.shape)
    return points + noise, np.repeat(np.arange(len(levels)), count)


def spiral(turns, count):
    z, angle = np.linspace(-1.49, 1.49, count), np.linspace(0.0, 2.0 * np.pi * turns, count)
    radius = np.sqrt(1.0 - (z / AXES[2]) ** 2)
    return np.stack([AXES[0] * radius * np.cos(angle), AXES[1] * radius * np.sin(angle), z], 1)


SCANS = {
    "closed sections": lambda: Scan(
        *[rings(np.linspace(-1.4, 1.4, 9), 60)[0], NOISE],
        curves=rings(np.linspace(-1.4, 1.4, 9), 60)[1],
    ),
    "one spiral": lambda: Scan(spiral(12, 900), NOISE, curves=np.zeros(900, int)),
    "a cloud": lambda: Scan(cloud(800, NOISE), NOISE),
    "half a cloud, seen": lambda: Scan(
        (half := cloud(900, NOISE))[half[:, 2] > 0.2], NOISE, viewpoint=[0.0, 0.0, 20.0]
    ),
    "half a cloud, one point outside": lambda: Scan(
        (half := cloud(900, NOISE))[half[:, 2] > 0.2], NOISE, outside=[0.0, 0.0, 2.0]
    ),
}


@pytest.mark.parametrize("name", SCANS)
def test_scans_of_an_ellipsoid_show_it_with_the_outside_out(name):
    atlas = Atlas(TOLERANCE)
    assert not atlas.add(SCANS[name]()).refused
    points = cloud(300, 0.0, seed=1)
    points = points[points[:, 2] > 0.2]
    found, known = atlas.body.at(points)
    # The ellipsoid is the quadric of all samples, surer than a sample; four deviations of it.
    assert known.mean() > 0.98
    assert np.abs(found.distance[known]).max() < 4.0 * atlas.sample_std
    assert (found.normal * points / AXES**2).sum(axis=1).min() > 0.0
    atlas.validate()


def test_points_of_no_curve_do_not_hide_the_edges_that_curves_show():
    rng, noise = np.random.default_rng(0), 0.01
    faces, side = rng.integers(0, 3, 600), rng.choice([-1.0, 1.0], 600)
    points, normals = rng.uniform(-1.0, 1.0, (600, 3)), np.zeros((600, 3))
    points[np.arange(600), faces] = normals[np.arange(600), faces] = side
    atlas = Atlas(0.01, scale=0.01)
    atlas.add(Scan(points + rng.normal(0.0, noise, points.shape), noise, normals=normals))
    # Squares about each axis, 40 points a side.
    along = np.linspace(-1.0, 1.0, 40, endpoint=False)
    corner = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    ends = np.stack([corner, np.roll(corner, -1, axis=0)], axis=1)
    flat = np.concatenate([a + 0.5 * (along[:, None] + 1.0) * (b - a) for a, b in ends])
    squares = [np.insert(flat, axis, level, 1) for axis in range(3) for level in (-0.5, 0.5)]
    curves = np.repeat(np.arange(6), len(flat))
    every = np.concatenate(squares) + rng.normal(0.0, 1e-3, (6 * len(flat), 3))
    atlas.add(Scan(every, 1e-3, curves=curves))
    assert [face.kind for face in atlas.body.faces.faces] == 6 * ["plane"]


def test_normals_at_the_limb_of_what_a_camera_saw_face_outward():
    # The noise is half of the spacing of the points: quadrics through few neighbours lean there.
    noise, eye, points = 0.03, np.array([0.0, 0.0, 20.0]), cloud(16000, 0.0)
    points = points[((eye - points) * points / AXES**2).sum(axis=1) > 0.0]
    points = points + np.random.default_rng(1).normal(0.0, noise, points.shape)
    atlas = Atlas(0.02, scale=0.01)
    assert not atlas.add(Scan(points, noise, viewpoint=eye)).refused
    assert (atlas.pool.normals * atlas.pool.points / AXES**2).sum(axis=1).min() > 0.0


def test_half_a_cloud_asks_for_its_outer_side():
    points = cloud(900, NOISE)
    atlas = Atlas(TOLERANCE)
    change = atlas.add(Scan(points[points[:, 2] > 0.2], NOISE))
    assert "nothing tells on which side the outside is" in change.refused
    assert not atlas.point_count


def test_single_points_with_normals_join_a_known_surface():
    atlas = Atlas(TOLERANCE)
    atlas.add(Scan(cloud(400, 0.01), 0.01))
    before = atlas.point_count
    normal = [[0.0, 0.0, 2.0]]
    assert not atlas.add(Scan([[0.0, 0.0, AXES[2]]], 1e-4, normals=normal)).refused
    assert atlas.point_count == before + 1
    assert atlas.pool.noise[-1] == 1e-4
    atlas.validate()


def test_points_that_were_learned_are_refused():
    atlas, scan = Atlas(TOLERANCE), Scan(cloud(300, NOISE), NOISE)
    atlas.add(scan)
    assert "learned before" in atlas.add(scan).refused


def test_sure_samples_outweigh_noisy_ones():
    # A noisy cloud that is off by its whole deviation, and exact curves in the same place.
    atlas = Atlas(TOLERANCE)
    atlas.add(Scan(1.02 * cloud(500, 0.0), 0.03))
    points, curves = rings(np.linspace(-1.4, 1.4, 12), 60)
    atlas.add(Scan(points, NOISE, curves=curves))
    found, _ = atlas.body.at(cloud(200, 0.0, seed=2))
    # Weights are as the inverse squares of 0.03 and 0.001: the cloud has a thousandth of them.
    assert np.abs(found.distance).max() < 4.0 * atlas.sample_std


def test_samples_of_a_dense_cloud_are_as_sure_as_they_say():
    noise = 0.01
    points = cloud(20000, noise)
    found = thinned(points, np.full(len(points), noise), 1000)
    off = off_ellipsoid(found.points) / found.noise
    # 900 squares of a deviation have a mean of 1 within 4 sqrt(2 / 900), and neighbours that
    # samples share make it smaller.
    assert 0.5 < np.mean(off**2) < 1.0 + 4.0 * np.sqrt(2.0 / len(off))
    assert np.median(found.noise) < 0.5 * noise


def test_a_saved_atlas_of_scans_is_the_same(tmp_path):
    atlas = Atlas(TOLERANCE)
    atlas.add(SCANS["closed sections"]())
    atlas.add(Scan(cloud(200, 0.01), 0.01))
    save_atlas(tmp_path / "one.npz", atlas)
    save_atlas(tmp_path / "two.npz", load_atlas(tmp_path / "one.npz"))
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


def test_scale_and_unit_do_not_change_what_a_scan_shows():
    one, other = Atlas(TOLERANCE), Atlas(1000.0 * TOLERANCE)
    points, curves = rings(np.linspace(-1.4, 1.4, 9), 60)
    one.add(Scan(points, NOISE, curves=curves))
    other.add(Scan(1000.0 * points, 1000.0 * NOISE, curves=curves))
    at = cloud(50, 0.0, seed=3)
    first, second = one.body.at(at)[0].distance, other.body.at(1000.0 * at)[0].distance
    assert np.allclose(1000.0 * first, second, atol=1e-6 * 1000.0)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"noise_std": -1.0}, "length >= 0"),
        ({"normals": [[0.0, 0.0, 0.0]]}, "length 0"),
        ({"viewpoint": [0.0, 1.0]}, "must have shape"),
        ({"curves": [0.5]}, "whole"),
    ],
)
def test_a_scan_says_what_is_wrong_with_it(arguments, words):
    columns = {"points": [[0.0, 0.0, 1.0]], "noise_std": 0.1} | arguments
    with pytest.raises(ValueError, match=words):
        Scan(**columns)


def test_a_bore_of_a_tenth_of_the_size_is_no_rim_in_another_unit():
    """Ten times as large it would lie on the rim of the ring, but faces the other way."""
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    radial = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(60)])

    def circles(radius, heights, side):
        rng = np.random.default_rng(0)
        exact = np.concatenate([radius * radial + [0.0, 0.0, z] for z in heights])
        points = exact + rng.normal(0.0, 0.02, exact.shape)
        normals = np.tile(side * radial, (len(heights), 1))
        curves = np.repeat(np.arange(len(heights)), 60)
        return Scan(points, np.full(len(points), 0.02), normals, curves=curves)

    atlas = Atlas(0.1)
    atlas.add(circles(100.0, np.linspace(100.0, 200.0, 12), 1.0))
    heights = np.linspace(10.0, 20.0, 5)
    with pytest.raises(ValueError, match="multiplied by 10"):
        atlas.add(circles(10.0, heights, 1.0))
    assert not atlas.add(circles(10.0, heights, -1.0)).refused


BOX, BOX_NOISE, BOX_TOLERANCE = np.array([60.0, 40.0, 30.0]), 0.06, 0.3


def lines_on_a_box(count=60, each=40):
    """Lines that each stay on one side of a box, and the outward normals of the sides."""
    rng = np.random.default_rng(3)
    points, outward = np.empty((2, count, each, 3))
    for line, normal in zip(points, outward, strict=True):
        across, along, over = rng.permutation(3)
        upper = rng.integers(2)
        line[:, across], line[:, over] = upper * BOX[across], rng.uniform(0.05, 0.95) * BOX[over]
        line[:, along] = np.linspace(0.02, 0.98, each) * BOX[along]
        normal[:] = (2 * upper - 1) * np.eye(3)[across]
        line[:] += rng.normal(0.0, BOX_NOISE, (each, 1)) * normal
    return points.reshape(-1, 3), outward.reshape(-1, 3)


@pytest.mark.parametrize("are_curves", [True, False])
def test_lines_that_stay_on_sides_of_a_box_show_its_edges_as_curves_and_as_a_cloud(are_curves):
    """No line runs over an edge. A side of ten lines of 40 points is sure to 0.06 / sqrt(400),
    0.003, in the middle and to three times that at its ends: 1.96 of it, on the worst of six
    sides, are below a fifth of the tolerance, 0.06. As one free-form face the box is ten times
    that off."""
    points, outward = lines_on_a_box()
    curves = np.repeat(np.arange(60), 40) if are_curves else None
    atlas = Atlas(BOX_TOLERANCE)
    assert not atlas.add(Scan(points, BOX_NOISE, approach=-outward, curves=curves)).refused
    assert [face.kind for face in atlas.faces().faces] == ["plane"] * 6
    assert len(atlas.body.faces.faces) == 6
    vertices = extract_surface(atlas).vertices
    off = np.abs(np.maximum(-vertices, vertices - BOX).max(axis=1))
    assert np.quantile(off, 0.95) < 0.2 * BOX_TOLERANCE


def test_a_cloud_of_a_free_form_body_is_one_face():
    """Waves of a tenth of the radius on a ball, which no law explains."""
    way = cloud(1500, 0.0) / AXES
    radius = 1.0 + 0.1 * np.sin(4.0 * way[:, :1]) * np.cos(3.0 * way[:, 1:2] + way[:, 2:])
    atlas = Atlas(TOLERANCE)
    atlas.add(Scan(radius * way, NOISE, outside=[0.0, 0.0, 3.0]))
    assert atlas.body.is_one_face and atlas.body.faces.faces[0].kind == "free-form"
