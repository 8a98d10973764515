"""Body: where the faces of a body are known, how far away they are, and how they bend."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from tests.lawful import (
    NOISE,
    body_of,
    box_distance,
    known_body,
    samples_of_touches,
    step_distance,
    touched,
    touched_mesh,
)
from tests.lawful_meshes import HALF, PLATE, RADIUS, lawful_object
from tests.touched import touched_samples
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.choose import shares_at_edges
from touchatlas.atlas.body.one_face import face_of_all
from touchatlas.atlas.body.thinned_samples import ThinnedSamples
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.sim.world.mesh_object import MeshObject

# Deviation of a sample that is told where there is no noise at all.
SURE = 1e-6
# Longest step of the contours here.
STEP = 1.0


def exact_box(keep=None, scale: float = 1.0):
    """A box touched without noise; ``keep`` says of points (n, 3) which samples there are."""
    columns = touched_mesh("box", 30, 0.0)
    kept = None if keep is None else keep(columns[0])
    return body_of(samples_of_touches(columns, SURE, kept, scale))


@pytest.fixture(scope="module")
def box():
    return exact_box()


@pytest.fixture(scope="module")
def surface():
    return lawful_object("box").sample(2000, np.random.default_rng(0))[0]


@pytest.fixture(scope="module")
def noisy_cylinder():
    return known_body("cylinder", 30)


def test_the_surface_of_a_box_is_the_largest_of_six_distances(box, surface):
    """Planes through samples without noise leave rounding of 1e-14 extents. Near an edge that few
    samples show, a point off the surface may be given to one plane alone: 2 of 2,000 are."""
    assert len(box.faces) == 6 and box.faces.are_lawful
    found, known = box.at(surface)
    assert np.abs(found.distance).max() < 1e-12
    assert known.mean() > 0.98
    off = surface + 0.5 * np.random.default_rng(1).normal(size=surface.shape)
    found, _ = box.at(off)
    wrong = np.abs(found.distance - box_distance(off)) > 1e-12
    assert wrong.mean() < 0.005
    # The normal is that of the plane which is the farthest out.
    axis = (np.abs(off) - HALF).argmax(axis=1)
    outward = np.sign(off) * (np.arange(3) == axis[:, None])
    assert np.abs(found.normal - outward)[~wrong].max() < 1e-9


def test_an_edge_without_a_curve_bounds_its_faces(box, surface):
    """A single contour over an edge gives no curve. Without the edge, faces of a step went on for
    3.1 mm beyond it, and its surface was open."""
    edges = tuple(replace(edge, curves=()) for edge in box.faces.edges)
    found, _ = Body(replace(box.faces, edges=edges), box.samples).at(surface)
    wrong = np.abs(found.distance - box_distance(surface)) > 1e-12
    assert wrong.mean() < 0.005


def test_beyond_an_edge_the_distance_is_that_of_the_intersection(box):
    """In the wedge beyond two planes, at the middle of an edge, it is the larger one."""
    out = np.array([[1.0, 0.0, 0.3], [0.2, 0.0, 0.7], [-0.4, 0.0, 0.1]])
    points = np.array([HALF[0], 2.0, HALF[2]]) + out
    found, known = box.at(points)
    assert found.distance == pytest.approx(out.max(axis=1), abs=1e-12)
    assert known.all()


def test_a_corner_of_a_cube_off_a_convex_edge_is_known_as_the_edge_is(noisy_cylinder):
    """Seen from a point off both faces instead of from its foot, the nearest samples may lie on one
    side: 1.5 of 100 points were unknown, and surfaces drawn in cubes had holes."""
    angle = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    out = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    edge = RADIUS * out + np.array([0.0, 0.0, noisy_cylinder.samples.points[:, 2].max()])
    known = noisy_cylinder.at(edge)[1]
    assert known.mean() > 0.95
    beside = noisy_cylinder.at(edge + 3.0 * out + np.array([0.0, 0.0, 3.0]))[1]
    assert beside[known].mean() > 0.99


def test_a_step_is_two_blocks_even_where_a_concave_edge_meets_two_convex_ones():
    """A face that ends at a concave edge bounds none beyond it. Near an edge that few samples
    show, a point off the surface may be given to one plane alone: 2 per mille are. A plane through
    100 samples or more is right to half of their deviation within its own extent."""
    body = known_body("step", 40)
    assert len(body.faces) == 8 and body.faces.are_lawful
    rng = np.random.default_rng(1)
    corners = np.array([[30.0, 20.0, 0.0], [30.0, 20.0, 30.0]])
    along = np.array([30.0, 20.0, 0.0]) + rng.uniform(0.0, 30.0, (600, 1)) * [0.0, 0.0, 1.0]
    points = np.concatenate([np.repeat(corners, 600, axis=0), along])
    points = points + rng.uniform(-3.0, 3.0, points.shape)
    found, known = body.at(points)
    assert known.mean() > 0.98
    wrong = np.abs(found.distance - step_distance(points)) > 0.5 * NOISE
    assert wrong.mean() < 0.005


def test_the_walls_of_a_post_do_not_divide_the_slab_that_it_stands_on():
    """No sample lies on the bottom below the wall and as far beside it, as where few contours run:
    there the nearest samples are those of the top, on the other side of the slab. A plane through
    100 samples is right to half of their deviation amid them."""
    columns = touched_mesh("wall on a slab", 60, NOISE)
    points = columns[0]
    seen = (points[:, 1] > 2.0) | (np.abs(points[:, 0]) > 10.0)
    body = body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE, seen))
    x, z = np.meshgrid(np.linspace(-9.0, 9.0, 19), np.linspace(3.0, 27.0, 9))
    below = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    for height in (-0.5, 0.0, 0.5):
        found, _ = body.at(below + [0.0, height, 0.0])
        assert np.abs(found.distance + height).max() < NOISE


def test_a_face_is_known_among_its_samples_and_not_beyond(surface):
    """All samples lie on one side of x = 5: beyond them, by more than a step and a half, no half
    circle is without a gap. The gaps between 30 touches are less than 3 % of what was touched."""
    half = exact_box(lambda points: points[:, 0] < 5.0)
    _, known = half.at(surface)
    assert known[surface[:, 0] < 0.0].mean() > 0.97
    assert not known[surface[:, 0] > 5.0 + 1.5 * STEP].any()


def test_beyond_its_samples_a_face_is_known_for_a_step_and_a_half():
    """The surface goes on past x = 5, where all samples end: their distance alone decides."""
    half = exact_box(lambda points: points[:, 0] < 5.0)
    surface = lawful_object("box").sample(20000, np.random.default_rng(0))[0]
    beyond = surface[surface[:, 0] > 5.0]
    samples = half.samples
    away, nearest = cKDTree(samples.points).query(beyond)
    steps, known = away / samples.steps[nearest], half.at(beyond)[1]
    # The points are on the surface of the object, and not of the body: up to the noise.
    assert known[steps < 1.49].all() and not known[steps > 1.51].any()


def test_the_sides_of_a_face_that_nothing_touched_are_not_known_beyond_it():
    """Without a sample of the upper face, the planes of the sides go on upwards as unknown."""
    open_box = exact_box(lambda points: points[:, 2] < HALF[2] - 0.1)
    rng = np.random.default_rng(2)
    along = rng.uniform(-1.0, 1.0, (200, 1)) * [HALF[0], 0.0, 0.0]
    above = along + [0.0, HALF[1], HALF[2]] + rng.uniform(2.0 * STEP, 8.0, (200, 1)) * [0, 0, 1.0]
    assert not open_box.at(above)[1].any()
    below = along * 0.9 + [0.0, HALF[1], 0.0]
    assert open_box.at(below)[1].mean() > 0.97


def test_a_corner_with_samples_on_its_three_faces_is_known():
    """Nothing within 5 of the corner was touched. Unfolded about the edges, samples of three faces
    are all around a place near it; in its own plane they fill a quarter circle."""
    body = exact_box(lambda points: np.linalg.norm(points - HALF, axis=1) > 5.0)
    rng = np.random.default_rng(3)
    points = HALF - rng.uniform(0.0, 2.0, (300, 3))
    side = np.arange(300) % 3
    points[np.arange(300), side] = HALF[side]
    assert body.at(points)[1].all()


def test_the_thickness_of_a_plate_is_that_between_its_faces():
    body = body_of(samples_of_touches(touched_mesh("plate", 40, 0.0), SURE))
    # Without noise rounding is left.
    assert body.thickness == pytest.approx(2.0 * PLATE[2], abs=1e-9)


def test_a_body_without_near_sides_has_no_thickness(box):
    """The nearest 48 thinned samples do not reach to the other side, 30 away."""
    assert box.thickness == np.inf


def test_planes_and_cylinders_have_no_gaussian_curvature(noisy_cylinder):
    """One principal curvature is 0; the other is 1 / r, squared 2.5e-3. Rounding is left."""
    body = noisy_cylinder
    points = lawful_object("cylinder").sample(500, np.random.default_rng(4))[0]
    found, _ = body.at(points)
    assert len(np.unique(found.face)) == 3
    assert np.abs(body.gaussian_curvature(points, found.face)).max() < 1e-12
    # The deviation of the radius, as told, is 3e-5 of it.
    assert body.largest_curvature == pytest.approx(1.0 / RADIUS, rel=3e-4)


def test_a_sphere_has_the_square_of_its_curvature():
    """1 / r^2, where the radius of 33 is right to 0.02 / sqrt(n), 4e-4 and 1e-5 of it; ten times
    that for noise that differs from contour to contour."""
    body = body_of(touched_samples("sphere", 30))
    # A sample itself is no division by zero.
    found, known = body.at(body.seeds)
    assert known.all()
    points = body.seeds - found.distance[:, None] * found.normal
    curvature = body.gaussian_curvature(points, found.face)
    assert curvature == pytest.approx(33.0**-2, rel=2e-4)
    # That of 16 samples off the sphere by their noise, 6e-4 of the radius: three deviations.
    assert body.largest_curvature == pytest.approx(1.0 / 33.0, rel=3.0 * 6e-4 / 4.0)


def test_contours_of_a_box_run_over_edges_and_those_of_an_ellipsoid_over_none():
    """The ellipsoid of half axes 30, 20 and 15 bends by 8 steps of 1 over radii of 7.5 at least,
    more than half of that as a cubic."""
    box = samples_of_touches(touched_mesh("box", 30, NOISE), NOISE)
    none = np.zeros(len(box), bool)
    assert shares_at_edges(box, none, none)[0] > 0.5
    smooth = samples_of_touches(touched_mesh("ellipsoid", 30, NOISE), NOISE)
    none = np.zeros(len(smooth), bool)
    assert shares_at_edges(smooth, none, none) == (0.0, 0.0)


def test_contours_that_end_at_edges_count_as_those_that_run_over_them():
    samples = samples_of_touches(touched_mesh("ellipsoid", 30, NOISE), NOISE)
    last = np.flatnonzero(np.diff(samples.contours, append=-1))
    assert len(last) == 90
    ends, none = np.isin(np.arange(len(samples)), last[:6]), np.zeros(len(samples), bool)
    assert shares_at_edges(samples, ends, none) == (6 / 90, 6 / 90)


def test_open_contours_of_scans_may_have_ended_at_edges_and_closed_ones_may_not():
    """Of 90 open contours of an ellipsoid six are of touches. A section of a ball is closed."""
    samples = samples_of_touches(touched_mesh("ellipsoid", 30, NOISE), NOISE)
    none, of_scan = np.zeros(len(samples), bool), samples.contours >= 6
    assert shares_at_edges(samples, none, of_scan) == (0.0, 0.0)
    assert shares_at_edges(samples, none, samples.contours >= 0) == (0.0, 1.0)
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    flat = np.tile([0.0, 0.0, 1.0], (60, 1))
    closed = contour_samples(20.0 * ring, ring, flat, NOISE)
    assert shares_at_edges(closed, np.zeros(60, bool), np.ones(60, bool)) == (0.0, 0.0)


def test_the_end_of_a_finger_is_not_among_the_samples_of_its_sides():
    """The pole of a round end, from which no sample is farther than 1.5 radii: all its sides
    have samples, but none that faces as it does. The sides are among them."""
    radius = 8.0
    capsule = trimesh.creation.capsule(height=60.0, radius=radius, count=[64, 64])
    finger = MeshObject("finger", capsule.vertices, capsule.faces)
    columns = touched(finger, 40, NOISE, 3, 20.0, 16)
    end = finger.bounds[1, 2] - radius
    samples = samples_of_touches(columns, NOISE, np.abs(columns[0][:, 2]) < end)
    outward = (
        samples.points * [1.0, 1.0, 0.0] / np.linalg.norm(samples.points[:, :2], axis=1)[:, None]
    )
    faces = replace(face_of_all(samples), normals=outward)
    thinned = ThinnedSamples(samples.points, faces, 2.0 * radius)
    points, normals = finger.sample(2000, np.random.default_rng(0))
    tip = normals[:, 2] > 0.99
    side = np.abs(points[:, 2] - end + 30.0) < 10.0
    assert cKDTree(samples.points).query(points[tip])[0].max() < 1.5 * radius
    assert tip.any() and not thinned.surround(points[tip], normals[tip]).any()
    assert thinned.surround(points[side], normals[side]).mean() > 0.99
    # At a sharp edge the far side does not face alike, and counts.
    sharp = ThinnedSamples(samples.points, replace(faces, is_sharp=True), 2.0 * radius)
    assert sharp.surround(points[tip], normals[tip]).all()


def test_a_rounding_does_not_go_on_where_one_of_its_faces_is_left_out():
    """The lower top of a step ends at its riser, but its edge with a side wall goes on as a line in
    this wall. A false radius took the wall away there, by up to 3.6 on an explored step. A ball of
    radius r takes at most (sqrt(2) - 1) r away."""
    exact = body_of(samples_of_touches(touched_mesh("step", 40, 0.0), SURE))
    (concave,) = [edge for edge in exact.faces.edges if edge.kind.sign < 0.0]
    inner = {concave.first, concave.second}
    blunt = [e for e in exact.faces.edges if e.kind.sign > 0.0 and {e.first, e.second} & inner]
    edges = tuple(replace(e, radius=0.2) if e in blunt else e for e in exact.faces.edges)
    body = Body(replace(exact.faces, edges=edges), exact.samples)
    surface, _ = lawful_object("step").sample(4000, np.random.default_rng(0))
    assert len(blunt) > 4
    assert np.abs(body.at(surface)[0].distance).max() < (np.sqrt(2.0) - 1.0) * 0.2 + 1e-9
