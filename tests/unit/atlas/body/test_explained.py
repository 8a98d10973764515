"""A plane is known when a contour tests it: when it lies where the others predict it."""

import numpy as np
import pytest

from touchatlas.atlas.body.read_faces import determined, faces_of_samples
from touchatlas.atlas.labels.samples import contour_samples

NOISE = 0.02


def kinds_on_lines(places, normals, length: float = 15.0):
    """The kinds of the faces on which contours of 30 samples run along x, through places (k, 2) in
    y and z with normals (k, 2): such lines one touch tracks on all faces along its own normal."""
    rng, along = np.random.default_rng(0), np.linspace(0.0, length, 30)
    points, outward, planes = [], [], []
    for place, normal in zip(np.asarray(places, float), np.asarray(normals, float), strict=True):
        noise = NOISE * rng.normal(size=(30, 1))
        points.append(np.column_stack([along, place + noise * normal]))
        outward.append(np.tile([0.0, *normal], (30, 1)))
        planes.append(np.tile([0.0, -normal[1], normal[0]], (30, 1)))
    columns = (np.concatenate(column) for column in (points, outward, planes))
    samples = contour_samples(*columns, NOISE)
    return [face.kind for face in determined(faces_of_samples(samples), samples).faces]


def test_a_plane_through_lines_on_two_faces_of_a_prism_is_no_face():
    """Any two parallel lines lie in one plane, here the oblique one of two sides at 30 degrees."""
    normals = np.array([[1.0, 0.0], [np.cos(np.pi / 6.0), 0.5]])
    assert kinds_on_lines(8.0 * normals, normals) == []


@pytest.mark.parametrize(("count", "found"), [(2, []), (3, ["plane"]), (6, ["plane"])])
def test_a_plane_needs_three_lines(count, found):
    places = [(2.0 * k, 0.0) for k in range(count)]
    assert kinds_on_lines(places, count * [(0.0, 1.0)]) == found


def test_a_bevel_that_three_contours_cross_is_a_face():
    """It is 2 wide and they are 4 apart: the first two predict the third within two deviations."""
    places = [(4.0 * k, 0.0) for k in range(3)]
    assert kinds_on_lines(places, 3 * [(0.0, 1.0)], length=2.0) == ["plane"]
