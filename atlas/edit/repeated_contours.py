"""Repeated contours: those that were learned before, found among the samples about them."""

import numpy as np

from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour


def learned_before(state: AtlasState, contact, contours: tuple[Contour, ...]) -> bool:
    """Whether the points of any contour of a touch are samples of the atlas already, bit for bit.

    Noise repeats no point: what is equal is the same measurement, or an exact one, and tells
    nothing the second time. Samples stand in the order of their contours, so that the middle one
    tells where the others are. It is looked for among those that patches about it brought: the
    time this takes does not depend on how many others there are.

    Parameters
    ----------
    contact : (3,) float, length, world
    """
    table, membership = state.table, state.membership
    paths = [contour.points_in_plane for contour in contours]
    away = [((path - contact) ** 2).sum(axis=1) for path in paths]
    middles = [int(square.argmin()) for square in away]
    reach = np.sqrt(max(square[k] for square, k in zip(away, middles, strict=True)))
    rows = table.index.rows_near(contact, float(reach)).tolist()
    index = membership.owned_by(state.neighbours.around(rows))
    samples = membership.pool.points
    first_of = samples[index, 0]
    for path, middle in zip(paths, middles, strict=True):
        for start in (index[first_of == path[middle, 0]] - middle).tolist():
            if start >= 0 and np.array_equal(samples[start : start + len(path)], path):
                return True
    return False
