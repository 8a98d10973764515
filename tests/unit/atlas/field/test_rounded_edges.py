"""Rounded edges: the ball that rounds them is known up to the faces that end it, on both sides."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import NOISE, body_of, samples_of_touches, touched, touched_mesh
from tests.lawful_meshes import COLUMN, FILLET, WIDE_FILLET, lawful_object
from touchatlas.atlas.field.face_field import FaceField

# Errors of planes, radii and positions of some thousandths, between samples: of 12 bodies with
# other touches the largest was 0.021.
MOST = 2.0 * NOISE
WIDE = "widely filleted"
# An edge is sharp where too few contours cross its rounding.
UNROUNDED = "roundings that one contour crosses may be missed: docs/limits.md"
MISSED = pytest.mark.xfail(strict=True, reason=UNROUNDED)
SLOW = pytest.mark.slow
QUICK = [("filleted", FILLET, 2), (WIDE, WIDE_FILLET, 1)]
OTHER = (WIDE, WIDE_FILLET, 0)
BODIES = [*QUICK, pytest.param(*OTHER, marks=SLOW)]


@lru_cache
def body(name: str, seed: int):
    columns = touched_mesh(name, 44 if name == "column" else 40, NOISE, seed)
    return body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE))


def on_fillet(radius: float, off: float = 0.0) -> np.ndarray:
    """Points of the fillet of a step, or so far out of it, from one end to the other."""
    angle, z = (x.ravel() for x in np.mgrid[0.02 : 0.5 * np.pi - 0.02 : 40j, 0.05:29.95:80j])
    r = radius - off
    return np.column_stack(
        [30.0 - radius + r * np.cos(angle), 20.0 + radius - r * np.sin(angle), z]
    )


def on_column() -> np.ndarray:
    """Points of the four rounded upright edges of the column, from the slab to the top."""
    points = lawful_object("column").sample(30000, np.random.default_rng(0))[0]
    on = (np.abs(points[:, :2]) > 16.0 - COLUMN).all(axis=1) & (points[:, 2] > 15.05)
    return points[on & (points[:, 2] < 34.95)]


def rounded(faces):
    return [edge for edge in faces.edges if edge.radius > 0.0]


@pytest.mark.parametrize(
    ("name", "radius", "seed"),
    [*QUICK, pytest.param(*OTHER, marks=[MISSED, SLOW])],
)
def test_a_fillet_is_known_up_to_the_faces_that_end_it(name, radius, seed):
    """These are planes that meet both of its faces in convex edges, and the fillet is concave. At
    its ends most of the nearest samples are theirs."""
    assert [round(edge.radius, 1) for edge in rounded(body(name, seed).faces)] == [radius]
    found, known = body(name, seed).at(on_fillet(radius))
    assert known.mean() > 0.99
    assert np.abs(found.distance[known]).max() < MOST


@pytest.mark.parametrize(("name", "radius", "seed"), BODIES)
def test_before_a_fillet_is_air_and_behind_it_the_body(name, radius, seed):
    """Not where the ends are nearer than the fillet, and no farther than the faces beside it."""
    for off in (-0.5, 0.5):
        points = on_fillet(radius, off)
        points = points[(points[:, 2] > 1.0) & (points[:, 2] < 29.0)]
        found, known = body(name, seed).at(points)
        assert np.abs(found.distance[known] - off).max() < MOST


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=[MISSED, SLOW])])
def test_the_rounded_edges_of_a_column_reach_from_the_slab_to_the_top(seed):
    """The slab meets the sides in concave edges, the top in convex ones, as the rounded edges
    are."""
    radii = [edge.radius for edge in rounded(body("column", seed).faces)]
    assert len(radii) == 4 and np.abs(np.array(radii) - COLUMN).max() < 0.1
    found, known = body("column", seed).at(on_column())
    assert known.mean() > 0.99
    assert np.abs(found.distance[known]).max() < MOST


@pytest.mark.parametrize(("name", "radius", "seed"), BODIES)
def test_samples_on_a_rounding_keep_other_faces_from_it(name, radius, seed):
    """Where no contour crossed the edges at its ends, the faces there have the nearest samples of
    faces, and nothing tells that they end the fillet."""
    faces = body(name, seed).faces
    alone = replace(faces, edges=tuple(rounded(faces)))
    samples = faces.points[alone.edges[0].samples]
    # Five deviations are none of 300 samples.
    assert np.abs(FaceField(alone).at(samples).distance).max() < 5.0 * faces.std


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=[MISSED, SLOW])])
def test_the_slab_goes_on_up_to_the_rounded_edges_of_a_column(seed):
    """Between the rounding and the sharp edge it is not as deep as the ball is far."""
    at = np.linspace(16.0 - COLUMN + 0.2, 15.8, 25)
    x, y = (grid.ravel() for grid in np.meshgrid(at, at))
    beside = np.hypot(x - 16.0 + COLUMN, y - 16.0 + COLUMN) > COLUMN + 0.5
    for height in (-0.5, 0.0, 0.5):
        for sides in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
            plane = np.column_stack([x[beside], y[beside]]) * sides
            points = np.column_stack([plane, np.full(len(plane), 15.0 + height)])
            found, known = body("column", seed).at(points)
            assert np.abs(found.distance[known] - height).max() < 5.0 * NOISE


@pytest.mark.slow
@MISSED
def test_roundings_that_face_each_other_do_not_take_each_other_for_ends():
    """Of two columns on one slab: each side across the gap between them lies outside of the
    other's."""
    columns = touched(lawful_object("two columns"), 90, NOISE, 2, 16.0, 16)
    faces = body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE))
    points = lawful_object("two columns").sample(60000, np.random.default_rng(0))[0]
    found, known = faces.at(points)
    assert known.mean() > 0.99
    assert np.abs(found.distance[known]).max() < 5.0 * NOISE
