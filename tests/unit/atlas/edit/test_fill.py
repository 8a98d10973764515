"""Holes between cells: where they are, and what is none."""

import numpy as np

from tests.explored import explored, spread_touches
from touchatlas.atlas import Atlas
from touchatlas.atlas.edit.fill import _holes, fill
from touchatlas.atlas.store import load_atlas, save_atlas
from touchatlas.sim import make_object


def closed_torus(tmp_path) -> Atlas:
    """A copy of the atlas of an explored torus, whose graph has no hole."""
    path = tmp_path / "torus.npz"
    save_atlas(path, explored("torus").atlas)
    return load_atlas(path)


def test_a_hole_between_cells_is_one_site_and_is_filled(tmp_path):
    """A torus without a patch has one hole, within the core of the patch that is missing."""
    atlas = closed_torus(tmp_path)
    assert not len(_holes(atlas))
    # The neighbours of the smallest patches cover these.
    row = sorted(atlas.graph, key=lambda i: atlas.table.weight[i])[len(atlas) // 2]
    assert atlas.graph.degree[row] >= 4
    site, core = atlas.table.site[row].copy(), np.sqrt(atlas.table.weight[row])
    atlas.remove([row])
    assert atlas.euler_characteristic() == -1
    (hole,) = _holes(atlas).points
    assert np.linalg.norm(hole - site) <= core
    fill(atlas)
    assert atlas.euler_characteristic() == 0 and not len(_holes(atlas))


def test_the_rim_of_what_was_touched_is_no_hole():
    obj = make_object("sphere")
    atlas = Atlas(obj.tolerance)
    for touch in spread_touches(obj, 30):
        if touch.contact[2] > 0.2 * obj.diagonal:
            atlas.add(touch)
    assert atlas.open_outlines().any() and atlas.surface_graph.odd_pairs()
    assert not len(_holes(atlas))


def test_gaps_beside_some_patches_are_those_of_all_with_one_of_them(tmp_path):
    """They are computed alone, and what is computed for others later is the same."""
    path = tmp_path / "sphere.npz"
    save_atlas(path, explored("sphere", max_touches=30).atlas)
    graphs = [load_atlas(path).surface_graph for _ in range(2)]
    every = {triple: point.tolist() for triple, point in graphs[0].gaps.items()}
    assert every
    rows = set(sorted(every)[0][:2])
    found = {triple: point.tolist() for triple, point in graphs[1].cells.gaps_of(rows).items()}
    assert found == {t: point for t, point in every.items() if not rows.isdisjoint(t)}
    assert {triple: point.tolist() for triple, point in graphs[1].gaps.items()} == every
