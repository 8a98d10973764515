"""Over an edge: where the face behind the end of a contour may be touched."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas

# Guesses at the far face, one after the other: whether the edge is convex, and how far from the
# edge to touch, in reaches. The near ones are for thin walls, low steps and blunt edges.
_GUESSES = ((True, 0.3), (False, 0.3), (True, 0.08), (False, 0.08))


@dataclass(frozen=True, eq=False)
class EdgeGuess:
    """A guess at the face behind an edge.

    Parameters
    ----------
    end : (3,) float, length, world
        Where a contour ended at the edge.
    tangent, normal : (3,) float, unit, world
        Direction of travel there, and outward normal of the near face.
    step : float, length
        Of the contour.
    home : int
        Patch of the near face.
    number : int
        Of the guess, from 0.
    """

    end: np.ndarray
    tangent: np.ndarray
    normal: np.ndarray
    step: float
    home: int
    number: int

    def target(self, reach: float):
        """Reference point (3,) and outward normal (3,) to touch with arms of a length.

        Behind a convex edge the face falls away from the near one and looks along the travel;
        behind a concave one it rises and looks back.
        """
        convex, share = _GUESSES[self.number]
        edge = self.end + 0.5 * self.step * self.tangent
        if convex:
            point = edge - share * reach * self.normal + 0.5 * self.step * self.tangent
            return point, self.tangent
        return edge + share * reach * self.normal, -self.tangent


def edge_guess(atlas: Atlas, position, tried) -> EdgeGuess | None:
    """The next guess at a face behind an edge; None when all were made.

    Ends with the fewest guesses come first, of these those of the patch nearest to the probe,
    and of its ends the one nearest to its centre: that contour meets its edge the most squarely.

    Parameters
    ----------
    atlas : Atlas
    position : (3,) float, length, world
        Where the probe is.
    tried : (m, 3) float, length, world
        Ends from which a guess was made, once for each guess.
    """
    ends = atlas.edge_ends
    if not len(ends):
        return None
    offset = ends.points[:, None] - np.asarray(tried, dtype=float).reshape(-1, 3)
    number = ((offset * offset).sum(axis=2) <= atlas.tolerance**2).sum(axis=1)
    if number.min() >= len(_GUESSES):
        return None
    sites = atlas.table.site[ends.home]
    away = ((sites - position) ** 2).sum(axis=1)
    arm = ((ends.points - sites) ** 2).sum(axis=1)
    i = int(np.lexsort((arm, away, number))[0])
    return EdgeGuess(
        ends.points[i],
        ends.tangents[i],
        ends.normals[i],
        float(ends.steps[i]),
        int(ends.home[i]),
        int(number[i]),
    )
