"""Bodies with sharp edges, explored over their edges, or by a probe whose contours end there."""

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_faces, sharp_object
from touchatlas.atlas import Atlas, Touch, TouchStatus, extract_surface
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import PlannerOptions, StopReason

NOISE = 0.02
# Faces and edges, counted by hand, and the distances from the axes x and z of concave ones, which
# run along y.
COUNTS = {"block": (6, 12), "step": (8, 18), "roof": (7, 15), "wall": (6, 12), "slot": (10, 24)}
# Exploring all others takes two minutes; the block shows most of the same, and the faces of a step
# are read from touches spread evenly elsewhere.
SLOW = pytest.mark.slow
BODIES = [pytest.param(n, marks=() if n == "block" else SLOW) for n in COUNTS]
CONCAVE = {"step": [(0.0, 0.0)], "slot": [(-6.0, -5.0), (6.0, -5.0)]}
# Largest turn of a contour, rad: the planner's, or less than a right angle, so that it ends at
# edges.
OVER, SHORT = PlannerOptions().max_turn, 0.8


@pytest.mark.parametrize("name", BODIES)
def test_a_polyhedron_has_its_faces_and_edges(name):
    faces = explored_faces(name, OVER).atlas.faces()
    assert (len(faces), len(faces.edges)) == COUNTS[name]
    concave = [edge for edge in faces.edges if edge.kind.value == "sharp concave"]
    lines = np.array(CONCAVE.get(name, []))
    assert len(concave) == len(lines)
    # No line is found of an edge that a single contour crossed.
    for curve in (curve for edge in concave for curve in edge.curves):
        off = np.abs(curve[:, None, [0, 2]] - lines).max(axis=2).min(axis=1)
        # Where two fitted planes meet, within some five deviations of both.
        assert off.max() < 5 * NOISE


@pytest.mark.parametrize("turn", [OVER, pytest.param(SHORT, marks=SLOW)])
def test_a_block_is_known_from_few_touches(turn):
    """It took 22 touches over its edges, and 35 of contours that end there."""
    found = explored_faces("block", turn)
    assert found.stop.reason is StopReason.KNOWN and len(found.touches) <= 50
    ends = [end for t in found.touches for c in t.contours for end in c.ends]
    # Contours of the first touch and beside edges turn by 45 degrees at most.
    assert (np.mean([end is ContourEnd.EDGE for end in ends]) > 0.3) == (turn == SHORT)
    assert len(found.atlas.body.faces) == 6
    found.atlas.validate()


@pytest.mark.parametrize(
    ("name", "turn"),
    [
        ("block", OVER),
        pytest.param("block", SHORT, marks=SLOW),
        pytest.param("step", OVER, marks=SLOW),
        pytest.param("slot", OVER, marks=SLOW),
    ],
)
def test_surface_of_a_polyhedron_is_closed_and_near_the_truth(name, turn):
    made = extract_surface(explored_faces(name, turn).atlas)
    pairs = np.sort(made.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    pairs, counts = np.unique(pairs, axis=0, return_counts=True)
    assert (counts == 2).all()
    assert len(np.unique(made.faces)) - len(pairs) + len(made.faces) == 2
    off = np.abs(sharp_object(name).value(made.vertices))
    # A plane through hundreds of samples errs by less than one of them; at 95 % here.
    assert np.quantile(off, 0.95) <= NOISE


@pytest.mark.parametrize("name", BODIES)
def test_triangles_do_not_run_across_edges(name):
    """Every triangle faces as one of the faces does: within 2 degrees, slivers apart, and those of
    a rounding that noise makes: a radius of 0.13 was found on one edge of a step."""
    atlas = explored_faces(name, OVER).atlas
    made = extract_surface(atlas)
    a, b, c = made.vertices[made.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    area = 0.5 * np.linalg.norm(normals, axis=1)
    samples, normal = sharp_object(name).sample(2000, np.random.default_rng(0))
    faces = np.unique(normal.round(6), axis=0)
    alike = (normals @ faces.T).max(axis=1) >= np.cos(np.deg2rad(2.0)) * 2.0 * area
    off = np.abs(atlas.body.field.trees.all_distances((a + b + c) / 3.0))
    for edge in atlas.body.faces.edges:
        assert edge.radius < 10 * NOISE
        alike |= off[:, [edge.first, edge.second]].max(axis=1) < 2.0 * edge.radius
    assert len(samples) == 2000 and area[~alike].sum() <= 1e-3 * area.sum()


@pytest.mark.parametrize("name", BODIES)
def test_distance_about_a_polyhedron_is_that_of_its_half_spaces(name):
    """Unions and intersections of exact half spaces (CSG), about the whole surface with its
    notches, by a tolerance. All but one in a thousand are within five deviations of a sample. An
    exploration ends with 0.995 known: corners beyond the last contours are not, 3 in 1000 of the
    block."""
    atlas = explored_faces(name, OVER).atlas
    obj, rng = sharp_object(name), np.random.default_rng(0)
    points, _ = obj.sample(10_000, rng)
    points = points + rng.normal(0.0, obj.tolerance, points.shape)
    seen = atlas.blend(points)
    off = np.abs(seen.distance - obj.value(points))
    assert seen.known.mean() > PlannerOptions().coverage
    assert np.nanquantile(off, 0.999) < 5 * NOISE


def test_nothing_is_known_beyond_an_edge():
    """On the plane of a face, but off the body: no flap of the face remains there."""
    flap = np.array([[35.0, 0.0, 20.0], [0.0, 35.0, 20.0], [35.0, 35.0, 20.0]])
    seen = explored_faces("block", OVER).atlas.blend(flap)
    assert (~seen.known | (seen.distance > 10.0)).all()


@pytest.mark.parametrize("name", ["sphere", "bottle"])
def test_contours_of_smooth_bodies_end_at_no_edge(name):
    assert not explored(name).atlas.pool.edges.any()


@pytest.mark.parametrize(("noise", "learns"), [(0.0, True), (1e-4, True), (0.05, False)])
def test_contours_within_their_noise_make_no_patch(noise, learns):
    """In the corner of a face two of three contours are 0.1 long: at a noise of 0.05 their
    directions are unknown by half a radian, and so is the normal."""
    ends, contours = (ContourEnd.EDGE, ContourEnd.LENGTH_REACHED), []
    for angle, length in ((0.0, 15.0), (1.0, 0.1), (2.1, 0.1)):
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        points = np.linspace(0.0, length, 9)[:, None] * along
        plane = SamplingPlane(np.zeros(3), np.cross(along, [0.0, 0.0, 1.0]))
        contours.append(Contour(points, plane, noise, ends))
    up, touched = np.array([0.0, 0.0, 1.0]), TouchStatus.TOUCHED
    atlas = Atlas(0.1)
    change = atlas.add(Touch(0, np.zeros(3), up, tuple(contours), touched, 15.2, 0.0))
    assert bool(len(atlas)) == learns and bool(change.refused) != learns
