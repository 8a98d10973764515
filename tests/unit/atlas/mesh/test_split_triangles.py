"""Triangles with cut edges stay a closed surface."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.mesh.refine import edges_of, split


def with_middles(points, faces, chosen):
    """A mesh, some edges of which are cut in their middles."""
    ends, sides = edges_of(faces)
    middle = np.where(chosen, len(points) + np.cumsum(chosen) - 1, -1)
    every = np.concatenate([points, points[ends[chosen]].mean(axis=1)])
    return trimesh.Trimesh(every, split(faces, middle[sides], every), process=False)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_any_edges_may_be_halved(share):
    """The same body: closed, of one side, with the volume and the area that it had."""
    before = trimesh.creation.icosphere(subdivisions=2)
    points, faces = np.array(before.vertices), np.array(before.faces)
    chosen = np.random.default_rng(0).random(len(edges_of(faces)[0])) < share
    after = with_middles(points, faces, chosen)
    assert after.is_watertight and after.is_winding_consistent and after.euler_number == 2
    # Each cut edge adds a triangle on both sides.
    assert len(after.faces) == len(faces) + 2 * chosen.sum()
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert after.area == pytest.approx(before.area, rel=1e-12)
