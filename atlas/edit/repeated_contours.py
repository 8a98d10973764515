"""Repeated contours: a contour that was learned before tells nothing new."""

import numpy as np

from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour


def learned_before(state: AtlasState, contact, contours: tuple[Contour, ...]) -> bool:
    """Whether the points of any contour of a touch are samples of the atlas already, bit for bit.

    Noise repeats no point, so equal points are the same measurement. The pool keeps the samples of
    a contour in order, so the point next to the contact tells where the others must be. Only
    samples of the patches near the contact are searched, so the time does not grow with the atlas.

    Parameters
    ----------
    state : AtlasState
    contact : (3,) float, length, world
    contours : tuple of Contour
    """
    table, membership = state.table, state.membership
    paths = [contour.points_in_plane for contour in contours]
    squares = [((path - contact) ** 2).sum(axis=1) for path in paths]
    middles = [int(square.argmin()) for square in squares]
    reach = np.sqrt(max(square.min() for square in squares))
    rows = table.index.rows_near(contact, float(reach)).tolist()
    index = membership.owned_by(state.neighbours.around(rows))
    samples = membership.pool.points
    first_of = samples[index, 0]
    for path, middle in zip(paths, middles, strict=True):
        for start in (index[first_of == path[middle, 0]] - middle).tolist():
            if start >= 0 and np.array_equal(samples[start : start + len(path)], path):
                return True
    return False
