"""Merging at the rim of what was touched: a merged patch claims no more than those before it."""

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.planner.planes import concurrent_planes
from touchatlas.sim.world.objects import make_object

ROW = [(i, 0) for i in range(6)]
PLACES = {
    "row": ROW,
    "L": ROW + [(0, j) for j in range(1, 6)],
    "U": ROW + [(i, j) for i in (0, 5) for j in range(1, 6)],
    "O": [(i, j) for i in range(6) for j in range(6) if {i, j} & {0, 5}],
    "square": [(i, j) for i in range(6) for j in range(6)],
}


def plane(places) -> Atlas:
    """A plane, touched at places 0.9 apart with arms of one."""
    atlas, rng, along = Atlas(0.01), np.random.default_rng(0), np.linspace(-1.0, 1.0, 15)
    normal = np.array([0.0, 0.0, 1.0])
    for place in places:
        contact, contours = np.array([*(0.9 * np.array(place)), 0.0]), []
        for cut in concurrent_planes(contact, normal, [1.0, 0.0, 0.0], 3):
            points = contact + along[:, None] * np.cross(cut.normal, normal)
            points += 2e-3 * rng.normal(size=points.shape)
            contours.append(Contour(points, cut, 2e-3, (ContourEnd.LENGTH_REACHED,) * 2))
        atlas.add(Touch(0, contact, normal, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0))
    return atlas


@pytest.mark.parametrize("shape", PLACES)
def test_merging_in_a_plane_claims_no_place_that_was_not_known(shape):
    """One polynomial holds all samples of a plane, but a ball that holds an L holds its notch."""
    atlas = plane(PLACES[shape])
    x, y = np.meshgrid(*[np.linspace(-3.0, 8.0, 111)] * 2)
    grid = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    count, before = len(atlas), atlas.blend(grid).known
    atlas.simplify()
    atlas.validate()
    after = atlas.blend(grid).known
    # Between two points where a disc is looked at, a twelfth of it apart, a place may slip in.
    assert (after & ~before).sum() <= 0.01 * before.sum()
    assert (before & ~after).sum() <= 0.01 * before.sum()
    if shape == "square":
        assert len(atlas) < count


def test_merging_half_a_ball_claims_no_place_that_was_not_known():
    """Within, where kin are all about, patches merge as they do on the whole ball."""
    touches = explored("sphere").touches
    atlas = Atlas(make_object("sphere").tolerance)
    for touch in touches:
        if touch.contact[0] > 0.0:
            atlas.add(touch)
    points, _ = make_object("sphere").sample(4000, np.random.default_rng(0))
    count, before = len(atlas), atlas.blend(points).known
    atlas.simplify()
    after = atlas.blend(points).known
    assert len(atlas) < 0.9 * count
    assert (after & ~before).sum() <= 0.01 * before.sum()
