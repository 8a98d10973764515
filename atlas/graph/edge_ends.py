"""EdgeEnds: contour ends at sharp edges that have no patch on their far side yet."""

from collections.abc import Sequence

import numpy as np

from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.contour import Contour, ContourEnd

# Largest distance from an edge to the last sample before it, in sampling steps: it is up to one
# step, and half a step is for noise. Doubled, edges of faces three steps apart are confused.
EDGE_STEPS = 1.5
# Largest cosine of the angle between the normals of different faces: 20 degrees. Doubled in angle,
# ends at blunt edges are never done.
_OTHER_FACE = np.cos(np.deg2rad(20.0))
# Number of sampling steps over which the direction of travel is measured. Doubled, it has half the
# noise and twice the error from curvature.
_RUN = 3


class EdgeEnds:
    """Ends of contours at sharp edges whose far side is unknown, as arrays over the ends.

    Attributes
    ----------
    points : (n, 3) float, length, world
        The last sample before the edge.
    tangents : (n, 3) float, unit, world
        Direction of travel at the end, across the edge.
    normals : (n, 3) float, unit, world
        Outward normal of the face.
    steps : (n,) float, length
        Distance between samples.
    home : (n,) int
        The patch that was made from the contour.
    """

    def __init__(self) -> None:
        self.points = np.zeros((0, 3))
        self.tangents = np.zeros((0, 3))
        self.normals = np.zeros((0, 3))
        self.steps = np.zeros(0)
        self.home = np.zeros(0, int)

    def __len__(self) -> int:
        return len(self.home)

    def extend(self, table: PatchTable, row: int, contours: Sequence[Contour]) -> None:
        """Add the ends at edges of the contours of patch ``row``, then call ``drop_passed``."""
        found = [end for contour in contours for end in _ends_of(contour)]
        if not found:
            return
        points, tangents, steps = (np.array(column) for column in zip(*found, strict=True))
        normals = patches_at(table, np.full((len(points), 1), row), points).normals[:, 0]
        tangents -= (tangents * normals).sum(axis=1)[:, None] * normals
        tangents /= np.sqrt((tangents * tangents).sum(axis=1))[:, None]
        new = points, tangents, normals, steps, np.full(len(points), row)
        for (name, column), values in zip(vars(self).items(), new, strict=True):
            setattr(self, name, np.concatenate([column, values]))
        self.drop_passed(table)

    def drop_passed(self, table: PatchTable) -> None:
        """Drop the ends that a patch of another face is near to: their far side is known."""
        if not len(self):
            return
        rows, which = table.index.near(self.points)
        seen = patches_at(table, rows[:, None], self.points[which])
        passes = np.abs(seen.distance[:, 0]) <= EDGE_STEPS * self.steps[which]
        passes &= seen.across[:, 0] <= 1.0
        passes &= (seen.normals[:, 0] * self.normals[which]).sum(axis=1) < _OTHER_FACE
        keep = np.ones(len(self), bool)
        keep[which[passes]] = False
        for name, column in vars(self).items():
            setattr(self, name, column[keep])

    def move_home(self, rows: list[int], row: int) -> None:
        """Give the ends of removed rows to patch ``row``."""
        self.home[np.isin(self.home, rows)] = row


def _ends_of(contour: Contour):
    """Point, tangent out of the contour, and sampling step of each end that is at an edge."""
    points = contour.points_in_plane
    run = min(_RUN, len(points) - 1)
    for side, inner, kind in ((0, run, contour.ends[0]), (-1, -1 - run, contour.ends[1])):
        if kind is ContourEnd.EDGE:
            chord = points[side] - points[inner]
            length = float(np.sqrt(chord @ chord))
            yield points[side], chord / length, length / run
