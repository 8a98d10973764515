"""Faces read from samples: what is read again, and what lies on them."""

from collections import Counter

import numpy as np
import pytest

from tests.lawful import known_body, samples_of_touches, touched_plate
from touchatlas.atlas.body.read_faces import faces_of_samples

NOISE = 0.02
STD = np.sqrt(2.0) * NOISE


def rounded_box():
    """Samples of a box with rounded edges, and their faces."""
    body = known_body("rounded", 34)
    return body.samples, body.faces


def plate():
    """The same of a plate."""
    samples = samples_of_touches(touched_plate(16, NOISE, 6), STD)
    return samples, faces_of_samples(samples)


@pytest.mark.parametrize("read", [rounded_box, pytest.param(plate, marks=pytest.mark.slow)])
def test_samples_that_are_read_again_keep_their_faces_and_edges(read):
    """Nothing new was touched. Samples beside rims may change sides, one of twenty of those without
    a face."""
    samples, faces = read()
    again = faces_of_samples(samples, before=faces)
    assert Counter(face.kind for face in again.faces) == Counter(f.kind for f in faces.faces)
    assert Counter(edge.kind for edge in again.edges) == Counter(e.kind for e in faces.edges)
    radii = [sorted(edge.radius for edge in some.edges) for some in (again, faces)]
    # Two deviations of the radius that is known least.
    assert radii[0] == pytest.approx(radii[1], rel=0.01)
    assert np.count_nonzero(again.of < 0) == pytest.approx(np.count_nonzero(faces.of < 0), rel=0.05)


def test_points_on_a_plane_are_surface_whichever_way_they_are_rounded():
    """The ball that rounds a corner says that what lies inside of all planes is outside of it. That
    is no reason to give a point of a plane to a ball that is far away."""
    body = known_body("rounded", 34)
    assert body.faces.corners
    planes = [face for face in body.faces.faces if face.kind == "plane"]
    assert len(planes) == 6
    for face in planes:
        foot = face.pieces[0].feet(face.pieces[0].feet(body.faces.points[face.samples]))
        # The last digits of numbers up to 30.
        for shift in (-1e-14, 0.0, 1e-14):
            found, _ = body.at(foot + shift)
            # Two steps of a contour: beside an edge the other face may decide.
            assert np.abs(found.distance).max() < 2.0 * np.median(body.samples.steps)
