"""Rounded corners: the ball that touches three faces whose edges have one radius."""

import numpy as np
import pytest

from tests.lawful import known_body
from tests.lawful_meshes import BLUNT, HALF
from touchatlas.atlas.faces.face_graph import as_json

SIGNS = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)


def rounded(scale: float = 1.0):
    return known_body("rounded", 34, scale)


def test_a_rounded_box_has_a_ball_at_each_of_its_corners():
    """The centres lie one radius within three planes, whose errors are those of some samples."""
    corners = rounded().faces.corners
    assert len(corners) == 8 and all(corner.sign == 1.0 for corner in corners)
    centres = np.array([corner.centre for corner in corners])
    order = np.lexsort(np.sign(centres).T)
    expected = SIGNS * (HALF - BLUNT)
    expected = expected[np.lexsort(np.sign(expected).T)]
    # A radius of some ten samples of 0.03 is known to 0.03 / sqrt(10) / (sqrt(2) - 1).
    assert centres[order] == pytest.approx(expected, abs=0.1)
    for corner in corners:
        assert corner.radius == pytest.approx(BLUNT, abs=0.1)


def test_samples_of_a_corner_lie_on_its_ball_and_are_explained():
    faces = rounded().faces
    for corner in faces.corners:
        off = np.linalg.norm(faces.points[corner.samples] - corner.centre, axis=1) - BLUNT
        assert np.abs(off).max(initial=0.0) < 0.3
        assert np.isin(corner.samples, faces.rounded).all()
        assert (faces.of[corner.samples] == -1).all()


def test_the_graph_names_the_faces_of_each_corner():
    data = as_json(rounded().faces)
    assert len(data["corners"]) == 8
    for corner in data["corners"]:
        assert corner["kind"] == "convex" and len(set(corner["faces"])) == 3
        assert corner["radius"] == pytest.approx(BLUNT, abs=0.1)


def test_sharp_corners_have_no_ball():
    assert known_body("box", 40).faces.corners == ()
