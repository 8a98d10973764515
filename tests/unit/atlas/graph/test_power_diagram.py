"""Boundaries and corners of cells against their definition by powers."""

import numpy as np
import pytest

from tests.explored import explored


def test_boundary_lies_on_the_radical_plane_and_on_both_patches():
    atlas = explored("sphere").atlas
    for i, j, data in list(atlas.graph.edges(data=True))[:40]:
        boundary = data["boundary"]
        assert boundary.patches == (min(i, j), max(i, j))
        if not len(boundary.points):
            continue
        offset_i = boundary.points - atlas.table.site[i]
        offset_j = boundary.points - atlas.table.site[j]
        power_i = (offset_i**2).sum(axis=1) - atlas.table.weight[i]
        power_j = (offset_j**2).sum(axis=1) - atlas.table.weight[j]
        assert power_i == pytest.approx(power_j, abs=1e-8 * atlas.table.weight[i])
        # Midway between two patches that are a noise or two apart.
        gap = max(np.abs(atlas.patch(k).signed_distance(boundary.points)).max() for k in (i, j))
        assert gap < 0.2
        assert boundary.gap_rms < 0.1


def test_corners_have_equal_power_of_three():
    atlas = explored("sphere").atlas
    table = atlas.table
    for triple, point in list(atlas.corners.items())[:60]:
        power = [((point - table.site[i]) ** 2).sum() - table.weight[i] for i in triple]
        assert np.ptp(power) < 1e-6 * table.weight[triple[0]]
