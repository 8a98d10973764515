"""Keys of a sparse lattice."""

import numpy as np
import pytest

from touchatlas.atlas.mesh.cubes import key, unkey


def test_keys_name_lattice_indices_and_ascend_with_them():
    indices = np.random.default_rng(0).integers(-500, 500, (200, 3))
    keys = key(indices)
    np.testing.assert_array_equal(unkey(keys), indices)
    np.testing.assert_array_equal(np.argsort(keys), np.lexsort(indices.T[::-1]))


def test_cubes_too_far_to_be_numbered_are_refused():
    with pytest.raises(ValueError, match="longer edge"):
        key(np.array([[1 << 20, 0, 0]]))
