"""Edge ends: where contours stopped at a sharp edge behind which no patch is known yet."""

from collections.abc import Sequence

import numpy as np

from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.contour import Contour, ContourEnd

# A patch passes an end when it is no farther from it than this many sampling steps: the last
# sample is up to one short of the edge.
_NEAR = 1.5
# A patch whose normal differs by less is of the same face.
_OTHER_FACE = np.cos(np.deg2rad(20.0))
# Samples over which the direction of travel is taken.
_RUN = 3


class EdgeEnds:
    """Ends of contours at sharp edges whose far side is unknown, kept compact.

    Attributes
    ----------
    points : (n, 3) float, length, world
        The last sample before the edge.
    tangents : (n, 3) float, unit, world
        Direction of travel there, away from the face.
    normals : (n, 3) float, unit, world
        Outward normal of the face.
    steps : (n,) float, length
        Between samples.
    home : (n,) int
        Patch of the face.
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
        """Add the ends of the contours of patch ``row`` that no patch settles yet."""
        found = [end for contour in contours for end in _ends_of(contour)]
        if not found:
            return
        points, tangents, steps = (np.array(column) for column in zip(*found, strict=True))
        normals = patches_at(table, np.full((len(points), 1), row), points).normals[:, 0]
        tangents -= (tangents * normals).sum(axis=1)[:, None] * normals
        tangents /= np.sqrt((tangents * tangents).sum(axis=1))[:, None]
        self.points = np.concatenate([self.points, points])
        self.tangents = np.concatenate([self.tangents, tangents])
        self.normals = np.concatenate([self.normals, normals])
        self.steps = np.concatenate([self.steps, steps])
        self.home = np.concatenate([self.home, np.full(len(points), row)])
        self.drop_passed(table)

    def drop_passed(self, table: PatchTable) -> None:
        """Drop the ends that a patch of another face passes."""
        if not len(self):
            return
        rows, which = table.index.near(self.points)
        seen = patches_at(table, rows[:, None], self.points[which])
        passes = np.abs(seen.distance[:, 0]) <= _NEAR * self.steps[which]
        passes &= seen.across[:, 0] <= 1.0
        passes &= (seen.normals[:, 0] * self.normals[which]).sum(axis=1) < _OTHER_FACE
        keep = np.ones(len(self), bool)
        keep[which[passes]] = False
        for name, column in vars(self).items():
            setattr(self, name, column[keep])

    def move_home(self, rows: list[int], row: int) -> None:
        """The ends of rows that are no more are at home at ``row``."""
        self.home[np.isin(self.home, rows)] = row


def _ends_of(contour: Contour):
    """Point, outward tangent and step of the ends of a contour that are at an edge."""
    points = contour.points_in_plane
    run = min(_RUN, len(points) - 1)
    for side, inner, kind in ((0, run, contour.ends[0]), (-1, -1 - run, contour.ends[1])):
        if kind is ContourEnd.EDGE:
            chord = points[side] - points[inner]
            length = float(np.sqrt(chord @ chord))
            yield points[side], chord / length, length / run
