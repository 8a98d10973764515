"""Creases that continue along an edge, and the sheets that a crease separates."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.sharp import explored_sharp
from touchatlas.atlas.edit.refresh import _facing_along, separate_sheets


def table_of(sites, weights):
    return SimpleNamespace(site=np.array(sites, float), weight=np.array(weights, float))


@pytest.mark.parametrize(("second_change", "facing"), [(0.4, (0, 3)), (0.8, (1, 2))])
def test_a_sliver_between_two_crossing_boundaries_is_found(second_change, facing):
    """Sheets {0, 1} and {2, 3} along the x axis, with points at 0 and 1. The owner of the first
    sheet changes at 0.6, midway between the sites 0.1 and 1.1; that of the second at 0.4 or at 0.8.
    So between 0.4 and 0.6 the patches 0 and 3 face each other, between 0.6 and 0.8 the patches
    1 and 2; at neither point do they."""
    shift = second_change - 0.5
    sites = [[0.1, 0, 0], [1.1, 0, 0], [shift, 0, 0], [1.0 + shift, 0, 0]]
    table = table_of(sites, np.ones(4))
    sheets = [np.array([0, 1]), np.array([2, 3])]
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    found = list(_facing_along(table, sheets, line))
    assert [pair for *pair, _ in found[:2]] == [[0, 2], [1, 3]]
    assert len(found) == 3 and found[2][:2] == facing
    assert found[2][2] == pytest.approx([0.5 * (0.6 + second_change), 0.0, 0.0])


def test_one_boundary_alone_makes_no_sliver():
    table = table_of([[0.1, 0, 0], [1.1, 0, 0], [0.5, 0, 0]], np.ones(3))
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    found = list(_facing_along(table, [np.array([0, 1]), np.array([2])], line))
    assert [pair for *pair, _ in found] == [[0, 2], [1, 2]]


def test_a_neighbour_of_both_sides_of_a_crease_stays_with_the_side_it_faces_as():
    """Top and side of a wall, and another patch of the top that was joined to both."""
    atlas = explored_sharp("wall", max_touches=20).atlas
    first, second = min(atlas.creases.pairs)
    normal = {i: atlas.patch(i).frame.normal for i in atlas.graph}
    beside = next(i for i in atlas.neighbours[first] if normal[i] @ normal[first] > 0.99)
    atlas.neighbours.join(second, beside)
    separate_sheets(atlas, first, second)
    assert beside in atlas.neighbours[first] and beside not in atlas.neighbours[second]
