"""Crease curves: kept as long as nothing that they are drawn from changes."""

import numpy as np

from tests.sharp import explored_sharp
from touchatlas.atlas.graph.crease_curves import crease_curves, sources_of


def test_curves_are_drawn_anew_where_a_patch_moved_and_nowhere_else():
    """What is kept equals, number by number, what is drawn from the patches as they are now."""
    atlas = explored_sharp("wall", max_touches=60).atlas
    curves, pairs = atlas.surface_graph.curves, sorted(atlas.creases.pairs)
    before = {pair: curves.curve(*pair) for pair in pairs}
    atlas.mark_stale(atlas.table.rows.tolist())
    assert all(curves.curve(*pair) is before[pair] for pair in pairs)
    for row in sorted({i for i, _ in pairs})[::5]:
        before = {pair: curves.curve(*pair) for pair in pairs}
        atlas.table.mean[row, 0] += 1e-3
        atlas.mark_stale([row])
        fresh = crease_curves(atlas.table, sources_of(atlas.table, atlas.creases, pairs))
        for pair, line in zip(pairs, fresh, strict=True):
            assert np.array_equal(curves.curve(*pair), line)
            assert row not in pair or curves.curve(*pair) is not before[pair]
        assert any(curves.curve(*pair) is before[pair] for pair in pairs)
