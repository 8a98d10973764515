"""Cells against brute force: corners of a small atlas over all triples of its patches."""

from itertools import combinations

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas.graph.cells import Cells, with_even_ends
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, Boundary, points_of_equal_power


@pytest.fixture(scope="module")
def atlas():
    return explored("sphere", max_touches=30).atlas


def test_corners_and_gaps_are_those_of_all_triples(atlas):
    """Three patches that are neighbours of each other have a corner, or a gap, where their powers
    are equal on the last of them and no neighbour of any of them has less."""
    table, neighbours = atlas.table, atlas.neighbours
    corners, gaps = {}, {}
    for i, j, k in combinations(sorted(atlas.graph), 3):
        if not (j in neighbours[i] and k in neighbours[i] and k in neighbours[j]):
            continue
        point = points_of_equal_power(table, *np.array([[k], [i], [j]]))[0]
        if np.isnan(point).any():
            continue
        powers = [np.sum((point - table.site[m]) ** 2) - table.weight[m] for m in (i, j, k)]
        assert np.ptp(powers) < 1e-6 * table.weight[k]
        assert abs(atlas.patch(k).signed_distance(point[None])[0]) < 1e-6 * table.radius[k]
        rivals = (neighbours[i] | neighbours[j] | neighbours[k]) - {i, j, k}
        if all(np.sum((point - table.site[m]) ** 2) - table.weight[m] >= powers[2] for m in rivals):
            excess = powers[2] / table.weight[[i, j, k]].max()
            (corners if excess <= CELL_MARGIN else gaps)[i, j, k] = point
    assert corners
    assert {t: p.tolist() for t, p in atlas.gaps.items()} == {
        t: p.tolist() for t, p in gaps.items()
    }
    # Where four patches have about equal power their triples disagree, and corners are mended.
    assert len(set(corners) ^ set(atlas.corners)) <= 2
    for triple in set(corners) & set(atlas.corners):
        assert np.array_equal(atlas.corners[triple], corners[triple])


def test_every_boundary_of_a_closed_atlas_ends_twice():
    atlas = explored("sphere").atlas
    ends = dict.fromkeys(atlas.graph.edges, 0)
    for triple in atlas.corners:
        for i, j in combinations(triple, 2):
            ends[(i, j) if (i, j) in ends else (j, i)] += 1
    assert set(ends.values()) == {2}


@pytest.mark.parametrize("change", ["lost", "added"])
def test_a_corner_that_was_lost_or_added_is_mended(change):
    """Without a corner its three boundaries end once each; it is found again, where the powers of
    the three are equal. With one too many they end three times each, and it is removed."""
    atlas = explored("sphere").atlas
    cells = Cells(atlas.table, atlas.neighbours)
    cells.mark_stale(atlas.table.rows.tolist())
    corners, boundaries = dict(cells.corners), dict(cells.boundaries)
    known = dict(corners)
    if change == "lost":
        triple = min(corners)
        del known[triple]
        found = with_even_ends(atlas.table, known, {}, boundaries)
        assert found.keys() == corners.keys()
        assert found[triple] == pytest.approx(corners[triple], abs=1e-9)
    else:
        # A clique of three boundaries that is no corner of the atlas, but for this entry.
        pairs = [(0, 10**6), (0, 10**6 + 1), (10**6, 10**6 + 1)]
        empty = np.zeros((0, 3))
        boundaries |= {pair: Boundary(pair, empty, 0.0, 0.0) for pair in pairs}
        known[0, 10**6, 10**6 + 1] = np.zeros(3)
        assert with_even_ends(atlas.table, known, {}, boundaries).keys() == corners.keys()
