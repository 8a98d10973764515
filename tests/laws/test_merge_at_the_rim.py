"""Merging at the rim of what was touched: a merged patch claims no more than those before it."""

import numpy as np
import pytest

from tests.explored import explored
from tests.flat import plane
from touchatlas.atlas import Atlas
from touchatlas.sim import make_object

ROW = [(i, 0) for i in range(6)]
PLACES = {
    "row": ROW,
    "L": ROW + [(0, j) for j in range(1, 6)],
    "U": ROW + [(i, j) for i in (0, 5) for j in range(1, 6)],
    "O": [(i, j) for i in range(6) for j in range(6) if {i, j} & {0, 5}],
    "square": [(i, j) for i in range(6) for j in range(6)],
}


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
    # Merging looks at points of a disc that are a twelfth of it apart: between two of them a
    # place may be missed.
    assert (after & ~before).sum() <= 0.01 * before.sum()
    assert (before & ~after).sum() <= 0.01 * before.sum()
    if shape == "square":
        assert len(atlas) < count


def test_merging_half_a_ball_claims_no_place_that_was_not_known():
    """Away from the rim patches merge as they do on the whole ball."""
    obj = make_object("sphere")
    atlas = Atlas(obj.tolerance)
    for touch in explored("sphere").touches:
        if touch.contact[0] > 0.0:
            atlas.add(touch)
    points, _ = obj.sample(4000, np.random.default_rng(0))
    count, before = len(atlas), atlas.blend(points).known
    atlas.simplify()
    after = atlas.blend(points).known
    assert len(atlas) < 0.9 * count
    assert (after & ~before).sum() <= 0.01 * before.sum()
