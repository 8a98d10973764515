"""The samples near a point against all distances."""

import numpy as np

from touchatlas.atlas.patches.sample_index import SampleIndex


def test_samples_are_found_and_counted_in_the_tree_and_beside_it():
    """The tree is not built again for the last samples."""
    rng, index = np.random.default_rng(0), SampleIndex()
    points = rng.normal(size=(220, 3))
    centres, radii = rng.normal(size=(9, 3)), rng.uniform(0.2, 1.5, 9)
    for some in (points[:0], points[:200], points):
        near = np.linalg.norm(some - centres[:, None], axis=2) <= radii[:, None]
        found = index.near(some, centres, radii)
        assert [i.tolist() for i in found] == [np.flatnonzero(line).tolist() for line in near]
        assert index.count(some, centres, radii).tolist() == near.sum(axis=1).tolist()
