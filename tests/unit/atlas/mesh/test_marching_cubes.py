"""Marching cubes on random signs."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.mesh.marching_cubes import CORNERS, ends_of, key, triangles, unkey


@pytest.mark.parametrize("seed", range(3))
def test_marching_cubes_close_any_signs(seed):
    """Even random sides of the corners are parted by a closed surface that faces out."""
    count = 12
    values = np.random.default_rng(seed).normal(size=(count,) * 3)
    for axis in range(3):
        values[(slice(None),) * axis + ([0, -1],)] = 1.0
    cubes = np.indices((count - 1,) * 3).reshape(3, -1).T
    inside = values[tuple(np.moveaxis(cubes[:, None] + CORNERS, -1, 0))] < 0.0
    edges, faces = np.unique(triangles(key(cubes - 5), inside), return_inverse=True)
    low, high = ends_of(edges)
    mesh = trimesh.Trimesh(0.5 * (unkey(low) + unkey(high)), faces.reshape(-1, 3), process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    # Halfway between the sides: about as much volume as corners inside.
    assert mesh.volume == pytest.approx((values < 0.0).sum(), rel=0.3)


def test_cubes_too_far_to_be_numbered_are_refused():
    with pytest.raises(ValueError, match="longer edge"):
        key(np.array([[1 << 20, 0, 0]]))
