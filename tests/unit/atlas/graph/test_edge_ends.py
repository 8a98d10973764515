"""Edge ends on a plane whose contours stop at an edge, and the patch that passes them."""

import numpy as np
import pytest

from tests.flat import UP, flat_touch
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.atlas.graph.edge_ends import EdgeEnds
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

STEP = 1.0 / 7.0


def at_edge() -> Atlas:
    """The plane z = 0 with three contours from x = -1 on, at 0 and +-45 degrees from the x axis,
    each of which stops at an edge ahead."""
    ends, contours = (ContourEnd.LENGTH_REACHED, ContourEnd.EDGE), []
    for angle in np.pi / 4.0 * np.array([-1.0, 0.0, 1.0]):
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        points = STEP * np.arange(-7, 8)[:, None] * along
        contours.append(
            Contour(points, SamplingPlane(np.zeros(3), np.cross(along, UP)), 1e-6, ends)
        )
    atlas = Atlas(0.05)
    atlas.add(Touch(0, np.zeros(3), UP, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0))
    return atlas


def test_an_end_is_the_last_sample_its_direction_and_its_step():
    ends = at_edge().edge_ends
    angles = np.pi / 4.0 * np.array([-1.0, 0.0, 1.0])
    ahead = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    assert ends.points == pytest.approx(ahead, abs=1e-5)
    assert ends.tangents == pytest.approx(ahead, abs=1e-4)
    assert ends.normals == pytest.approx(np.tile(UP, (3, 1)), abs=1e-4)
    assert ends.steps == pytest.approx(STEP, abs=1e-5)
    assert ends.home.tolist() == [0, 0, 0]


@pytest.mark.parametrize(("tilt", "off", "left"), [(90.0, 1.0, 2), (90.0, 2.0, 3), (10.0, 0.0, 3)])
def test_a_patch_of_another_face_passes_the_ends_within_one_and_a_half_steps(tilt, off, left):
    """A plane that runs past the end ahead, (1, 0, 0), ``off`` steps beyond it. It is of another
    face when its normal differs by more than 20 degrees; the other two ends are farther away."""
    atlas = at_edge()
    ends = EdgeEnds()
    for name, column in vars(atlas.edge_ends).items():
        setattr(ends, name, column.copy())
    angle = np.deg2rad(tilt)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    first = np.array([0.0, 1.0, 0.0])
    contact = np.array([1.0 + off * STEP, 0.0, 0.0])
    other = Atlas(0.05)
    other.add(flat_touch(contact, normal, first, 1e-6, np.random.default_rng(0)))
    ends.drop_passed(other.table)
    # At 45 degrees the last samples are 0.29 farther back: two steps.
    assert len(ends) == left


def test_ends_of_removed_patches_move_to_their_heir():
    ends = at_edge().edge_ends
    ends.move_home([0], 7)
    assert ends.home.tolist() == [7, 7, 7]
