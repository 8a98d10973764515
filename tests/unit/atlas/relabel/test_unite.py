"""Parts of one plane that no contour joins are one face, unless another face stands between."""

import numpy as np
import pytest

from touchatlas.atlas.body.read_faces import faces_of_samples
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.relabel.unite import unite

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


@pytest.mark.parametrize(("height", "united"), [(0.0, True), (-2.0, False)])
def test_a_label_on_the_plane_of_two_parts_does_not_part_them(height, united):
    """One contour across the gap has a piece that crosses the way: a curve in a plane lies on many
    faces. Below the plane of both parts such samples are of a wall."""
    rng, forward = np.random.default_rng(0), np.cross(UP, ACROSS)
    between = strip(height * UP, forward, UP if height else ACROSS, ACROSS, rng)
    parts = [*tops(0.0, 4.0, rng), between if height else tuple(c[5:6] for c in between)]
    labels = labels_of(parts, (UP, UP, ACROSS))
    unite(labels)
    assert (labels.of[0] == labels.of[parts[0][0].size // 3]) == united


@pytest.mark.parametrize(("inward", "united"), [(0.0, True), (1.0, False)])
def test_a_label_on_a_larger_face_does_not_part_others(inward, united):
    """A contour on the side below two parts of a top, whose sampling plane touches this side, has
    a piece that crosses the way from one part to the other. Farther in it is of the wall of a
    slot."""
    rng, forward = np.random.default_rng(0), np.cross(UP, ACROSS)
    ends = [tuple(column[:, -4:] for column in top) for top in tops(0.0, 4.0, rng)]
    side = 5.2 * forward - 6.0 * UP
    wall = strip(side - inward * forward, UP, forward, ACROSS, rng)
    parts = [*ends, tuple(c[5:6] for c in wall), strip(side, UP, ACROSS, forward, rng)]
    labels = labels_of(parts, (UP, UP, ACROSS, forward))
    unite(labels)
    assert (labels.of[0] == labels.of[parts[0][0].size // 3]) == united


def labels_of(parts, outward) -> Labels:
    """Labels of parts, each with a plane that faces ``outward``."""
    columns = [np.concatenate([part[k].reshape(-1, 3) for part in parts]) for k in range(3)]
    samples = contour_samples(*columns, STD)
    labels, begin = Labels(Evidence(samples, SampleGraph(samples), FaceOptions())), 0
    for part, normal in zip(parts, outward, strict=True):
        members = begin + np.arange(part[0].size // 3)
        first = ACROSS if normal is not ACROSS else UP
        frame = np.stack([first, np.cross(normal, first), normal])
        middle = samples.points[members].mean(axis=0)
        none = np.zeros(3), np.zeros((3, 3))
        labels.add(Piece(Kind.PLANE, middle, frame, 10.0, *none), members)
        begin += len(members)
    return labels
