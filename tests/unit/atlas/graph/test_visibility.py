"""Which places of a sheet lie beyond its creases."""

import numpy as np

from tests.sharp import explored_sharp

NOISE = 0.02


def test_domain_ends_at_the_crease():
    """No point of a face is beyond a crease; of its plane outside the face nearly all are that
    a patch reaches, but for edges that the patch itself hardly reaches."""
    atlas = explored_sharp("block").atlas
    rng, outside = np.random.default_rng(0), []
    for row in [i for i in atlas.graph if atlas.table.axes[i, 2, 2] > 0.99]:
        near = rng.uniform(-1.0, 1.0, (400, 3)) * 15.0 + atlas.table.site[row]
        near[:, 2] = 20.0
        reach = np.abs(near[:, :2]).max(axis=1)
        beyond = atlas.surface_graph.visibility.beyond(np.full(len(near), row), near)
        assert not beyond[reach < 20.0 - 5 * NOISE].any()
        outside.append(beyond[reach > 20.0 + 5 * NOISE])
    assert np.concatenate(outside).mean() > 0.9
