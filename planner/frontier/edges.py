"""Edges: guesses where the face behind the end of a contour may be touched."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas

# Guesses at the far face in turn: whether the edge is convex, and how far from the edge to touch,
# in reaches. The near ones are for thin walls, low steps and blunt edges. With distances doubled,
# touches miss the sides of thinner bodies.
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
        Distance between samples of the contour.
    home : int
        Patch of the near face.
    number : int
        Number of the guess, from 0.
    """

    end: np.ndarray
    tangent: np.ndarray
    normal: np.ndarray
    step: float
    home: int
    number: int

    def target(self, reach: float):
        """Reference point (3,) and outward normal (3,) of a touch with arms of length ``reach``.

        Behind a convex edge the face is taken to fall away at a right angle, with its outward
        normal along the travel. Behind a concave edge it is taken to rise, facing back.
        """
        convex, fraction = _GUESSES[self.number]
        edge = self.end + 0.5 * self.step * self.tangent
        if convex:
            point = edge - fraction * reach * self.normal + 0.5 * self.step * self.tangent
            return point, self.tangent
        return edge + fraction * reach * self.normal, -self.tangent


def edge_guess(atlas: Atlas, position, tried) -> EdgeGuess | None:
    """The next guess at a face behind an edge; None when all were made.

    Ends with the fewest guesses come first, and of these the ends of the patch nearest to the
    probe. Of its ends the one nearest to the site comes first, because that contour meets the edge
    at the largest angle.

    Parameters
    ----------
    atlas : Atlas
    position : (3,) float, length, world
        Where the probe is.
    tried : (m, 3) float, length, world
        The end of each guess that was made before.
    """
    ends = atlas.edge_ends
    if not len(ends):
        return None
    offset = ends.points[:, None] - np.asarray(tried, dtype=float).reshape(-1, 3)
    number = ((offset * offset).sum(axis=2) <= atlas.scale**2).sum(axis=1)
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
