"""Repetition: contours that were learned before, found again among the samples about them."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.patch.contour import Contour

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas


def learned_before(atlas: "Atlas", contact, contours: tuple[Contour, ...]) -> bool:
    """Whether the points of any contour of a touch are samples of the atlas already, bit for bit.

    Noise repeats no point: what is equal is the same measurement, or an exact one, and tells
    nothing the second time. Samples stand in the order of their contours, so that the middle one
    tells where the others are. It is looked for among those that patches about it brought: the
    time this takes does not depend on how many others there are.

    Parameters
    ----------
    contact : (3,) float, length, world
    """
    table, learning = atlas.table, atlas.learning
    paths = [contour.points_in_plane for contour in contours]
    middles = [int(((path - contact) ** 2).sum(axis=1).argmin()) for path in paths]
    rows, _ = table.index.near(np.array([path[k] for path, k in zip(paths, middles, strict=True)]))
    about = set(rows.tolist()).union(*(atlas.kin[row] for row in set(rows.tolist())))
    index = learning.brought_by(sorted(about))
    samples = learning.pool.points
    near = samples[index]
    for path, middle in zip(paths, middles, strict=True):
        for first in (index[(near == path[middle]).all(axis=1)] - middle).tolist():
            if first >= 0 and np.array_equal(samples[first : first + len(path)], path):
                return True
    return False
