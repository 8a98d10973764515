"""The frontier against a look at every sample and every patch."""

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp

ATLASES = {
    "torus": lambda: explored("torus", max_touches=15).atlas,
    "block": lambda: explored_sharp("block", max_touches=15).atlas,
    "roof": lambda: explored_sharp("roof", max_touches=20).atlas,
}


def on_its_sheet(atlas, row: int, point, normal) -> bool:
    """Whether a sample is within the patch radius and a quarter of it off, and faces as it does."""
    patch = atlas.patch(row)
    if np.linalg.norm(point - patch.frame.origin) > patch.radius:
        return False
    near = abs(patch.signed_distance(point[None])[0]) <= 0.25 * patch.radius
    return bool(near and patch.normal(point[None])[0] @ normal >= 0.0)


def is_in_core(atlas, row: int, point) -> bool:
    return bool(np.sum((point - atlas.table.site[row]) ** 2) <= atlas.table.weight[row])


@pytest.mark.parametrize("name", ATLASES)
def test_frontier_is_what_no_core_of_its_sheet_covers(name):
    """Not the last samples before an edge, nor places that were touched in vain; no sample in the
    core of its owner, of a sheet neighbour of it, or of any patch whose sheet it may be of."""
    atlas = ATLASES[name]()
    pool, expected = atlas.membership.pool, []
    owner = {k: row for row in atlas.graph for k in atlas.membership.owned[row].tolist()}
    assert sorted(owner) == list(range(len(pool)))
    for k, row in sorted(owner.items()):
        sheet = {row, *atlas.neighbours[row]}
        covered = any(is_in_core(atlas, j, pool.points[k]) for j in sheet)
        covered |= any(
            is_in_core(atlas, j, pool.points[k])
            and on_its_sheet(atlas, j, pool.points[k], pool.normals[k])
            for j in atlas.graph
        )
        if not (covered or pool.edges[k] or pool.visited[k]):
            expected.append(k)
    assert expected
    assert atlas.frontier.samples.tolist() == expected


def test_depth_is_the_least_distance_in_core_radii():
    atlas = ATLASES["torus"]()
    pool, table = atlas.membership.pool, atlas.table
    samples = atlas.frontier.samples
    owners = atlas.frontier.owners(samples).tolist()
    depths = atlas.frontier.depth(samples).tolist()
    for k, row, depth in zip(samples.tolist(), owners, depths, strict=True):
        assert k in atlas.membership.owned[row]
        reach = [
            np.linalg.norm(pool.points[k] - table.site[j]) / np.sqrt(table.weight[j])
            for j in (row, *atlas.neighbours[row])
        ]
        assert depth == pytest.approx(min(reach), rel=1e-12)
        assert depth > 1.0


def test_a_patch_with_the_most_neighbours_covers_its_own_samples():
    """Its line of neighbours has no padding, so that it does not stand in its own line."""
    atlas = explored("torus", max_touches=30).atlas
    before = atlas.frontier.candidates()
    rows, lines = atlas.table.rows.tolist(), atlas.neighbours.lines()
    most = max(len(atlas.neighbours[row]) for row in rows)
    atlas.neighbours._lines = lines[:, :most].copy()
    atlas.frontier.mark_stale(rows)
    assert np.array_equal(atlas.frontier.candidates(), before)
