"""Parts of one plane that no contour joins are one face, unless another face stands between."""

import numpy as np
import pytest

from touchatlas.atlas.body.read_faces import faces_of_samples
from touchatlas.atlas.labels.samples import contour_samples

STD = 0.02
UP, ACROSS = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def strip(centre, along, across, outward, rng):
    """Samples of 11 straight contours of 21 points along ``along``, 0.7 apart across: points,
    outward directions and plane normals (n, 3)."""
    ways = 0.7 * np.arange(-5, 6)[:, None, None] * across
    points = centre + ways + 0.5 * np.arange(-10, 11)[None, :, None] * along
    points = points + rng.normal(0.0, STD, points.shape)
    planes = np.broadcast_to(across, points.shape) + 1e-3 * np.arange(11)[:, None, None] * along
    return points, np.broadcast_to(outward, points.shape), planes


def faces_of(*strips):
    columns = [np.concatenate([part[k].reshape(-1, 3) for part in strips]) for k in range(3)]
    return faces_of_samples(contour_samples(*columns, STD))


def tops(rise: float, apart: float, rng):
    """Two strips that face upward, 7 wide and 10 long, so far apart and of such heights."""
    forward, middle = np.cross(UP, ACROSS), 3.5 + 0.5 * apart
    return [
        strip(side * middle * ACROSS + height * UP, forward, ACROSS, UP, rng)
        for side, height in ((-1.0, 0.0), (1.0, rise))
    ]


@pytest.mark.parametrize(("rise", "count"), [(0.0, 1), (0.5, 2)])
def test_parts_of_one_plane_are_one_face(rise, count):
    """A gap of 2.4 in an extent of 19 is a third larger than neighbours on a contour are linked
    over. Half a millimetre of rise is 25 deviations of a sample."""
    found = faces_of(*tops(rise, 2.4, np.random.default_rng(0)))
    assert len(found) == count
    assert (found.of >= 0).all()


def test_tops_beside_a_slot_are_two_faces():
    """The walls of the slot between them were touched, too."""
    rng = np.random.default_rng(0)
    forward = np.cross(UP, ACROSS)
    walls = [
        strip(side * 1.2 * ACROSS - 4.0 * UP, forward, UP, -side * ACROSS, rng)
        for side in (-1.0, 1.0)
    ]
    found = faces_of(*tops(0.0, 3.0, rng), *walls)
    level = [face for face in found.faces if face.pieces[0].axes[2] @ UP > 0.99]
    assert len(level) == 2 and len(found) == 4


def test_the_nearest_parts_of_a_plane_are_joined_before_far_ones():
    """Three strips in a row, the smallest in the middle: a wall below stands between the outer two,
    as deep as two thirds of their distance, but not between neighbours."""
    rng = np.random.default_rng(0)
    forward = np.cross(UP, ACROSS)
    left, right = tops(0.0, 9.0, rng)
    middle = strip(np.zeros(3), forward, ACROSS, UP, rng)
    middle = tuple(column[3:8] for column in middle)
    wall = strip(3.0 * ACROSS - 12.0 * UP, forward, UP, ACROSS, rng)
    found = faces_of(left, middle, right, wall)
    assert len(found) == 2
