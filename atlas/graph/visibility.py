"""Visibility: the part of a patch on the near side of all creases.

A patch covers the points that its centre sees along the tangent plane: the straight line between
them crosses no crease of the patch's own sheet.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.crease_curves import CreaseCurves
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# Distance from the centre beyond which creases hide nothing of a patch, in patch radii: its samples
# end at one radius. Doubled, only the time changes.
_FAR = 1.3
# Least distance of the centre from the creases of the patch, on its inner side, in patch radii: the
# error of a site is smaller. Doubled, the centre sees past short creases.
_CLEAR = 0.05
# Number of pairs of a point and a segment in one numpy call. Doubled, a call takes 100 MB.
_AT_ONCE = 1 << 21


class Visibility:
    """Which points on the patches of a table lie beyond their creases.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    creases : Creases
    curves : CreaseCurves
    """

    def __init__(
        self,
        table: PatchTable,
        neighbours: SheetNeighbours,
        creases: Creases,
        curves: CreaseCurves,
    ) -> None:
        self._table, self._neighbours = table, neighbours
        self._creases, self._curves = creases, curves
        self._segments: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._centres: dict[int, np.ndarray] = {}

    def mark_stale(self) -> None:
        """A patch or a crease changed: compute everything again at the next reading."""
        self._segments.clear()
        self._centres.clear()

    def beyond(self, rows, points) -> np.ndarray:
        """(m,) whether points (m, 3) on patches ``rows`` (m,) lie beyond a crease of the sheet."""
        rows = np.asarray(rows)
        out = np.zeros(len(rows), bool)
        if not self._creases or not len(rows):
            return out
        for row in np.unique(rows).tolist():
            segments, _ = self._segments_of(row)
            if len(segments):
                here = np.flatnonzero(rows == row)
                flat = self._over_plane(row, points[here])
                step = max(1, _AT_ONCE // len(segments))
                for i in range(0, len(here), step):
                    crossed = _crossed(flat[i : i + step], segments)
                    out[here[i : i + step]] = crossed.any(axis=1)
        return out

    def crossed(self, rows, points) -> list[set[int]]:
        """For each of points (m, 3) on patches ``rows`` (m,), the patches behind the creases that
        the point lies beyond."""
        out: list[set[int]] = [set() for _ in rows]
        for row in np.unique(rows).tolist():
            segments, partners = self._segments_of(row)
            here = np.flatnonzero(rows == row)
            at, which = np.nonzero(_crossed(self._over_plane(row, points[here]), segments))
            for i, j in zip(here[at].tolist(), partners[which].tolist(), strict=True):
                out[i].add(j)
        return out

    def sees(self, rows, feet, own) -> np.ndarray:
        """(m,) whether ``own`` (m,) is true and the foot (m, 3) on patch ``rows`` (m,) lies on the
        near side of all creases."""
        out, some = own.copy(), np.flatnonzero(own)
        out[some] = ~self.beyond(np.asarray(rows)[some], feet[some])
        return out

    def centre(self, row: int) -> np.ndarray:
        """(3,) the site of a row, moved to the inner side of its creases where it is not there."""
        if row not in self._centres:
            table, centre = self._table, self._table.site[row].copy()
            for j in sorted(self._creases.of(row)):
                seen = patches_at(table, np.array([[j]]), centre[None])
                sign, off = self._creases.sign(row, j), float(seen.distance[0, 0])
                inside = sign * off + _CLEAR * table.radius[row]
                if inside > 0.0 and seen.across[0, 0] <= 1.0:
                    centre -= sign * inside * seen.normals[0, 0]
            self._centres[row] = centre
        return self._centres[row]

    def segments_about(self, rows: Iterable[int]) -> np.ndarray:
        """(s, 2, 3) the creases of the rows and their neighbours, as segments, world."""
        sheet = sorted(self._neighbours.around(rows))
        lines = [self._curves.curve(i, j) for i in sheet for j in sorted(self._creases.of(i))]
        pieces = [np.stack([a[:-1], a[1:]], axis=1) for a in lines if len(a)]
        return np.concatenate(pieces) if pieces else np.zeros((0, 2, 3))

    def _over_plane(self, row: int, points) -> np.ndarray:
        """(n, 2) points (n, 3) along the tangent plane of a row, from its centre."""
        return over_plane(self._table, row, self.centre(row), points)

    def _segments_of(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """The creases of a row's sheet as segments (s, 2, 2) along its tangent plane, and the patch
        (s,) behind each."""
        if row not in self._segments:
            mine = self._creases.of(row)
            pairs = [(row, j) for j in sorted(mine)]
            around = self._neighbours[row]
            pairs += [(k, j) for k in around for j in sorted(self._creases.of(k) - mine)]
            lines = [self._curves.curve(*pair) for pair in pairs]
            which = np.repeat(np.arange(len(lines)), np.array([len(a) for a in lines], int))
            flat = self._over_plane(row, np.concatenate([np.zeros((0, 3)), *lines]))
            segments = np.stack([flat[:-1], flat[1:]], axis=1)
            kept = ((segments * segments).sum(axis=2) <= _FAR**2).any(axis=1)
            kept &= which[:-1] == which[1:]
            partners = np.array([j for _, j in pairs], int)[which[:-1][kept]]
            self._segments[row] = segments[kept], partners
        return self._segments[row]


def over_plane(table: PatchTable, row: int, centre, points) -> np.ndarray:
    """(n, 2) points (n, 3) along the tangent plane of a row, from a centre (3,), in patch radii."""
    flat: np.ndarray = (points - centre) @ table.axes[row, :2].T / table.radius[row]
    return flat


def is_behind(table: PatchTable, row: int, centre, points, segments, part: float = 1.0):
    """(n,) whether any of segments (s, 2, 3) lies between a centre and points (n, 3), along the
    tangent plane of a row.

    ``part`` is the fraction of the line to each point that is tested.
    """
    flat = over_plane(table, row, centre, segments.reshape(-1, 3)).reshape(-1, 2, 2)
    crossed = _crossed(part * over_plane(table, row, centre, points), flat)
    return np.asarray(crossed.any(axis=1))


def _crossed(points, segments) -> np.ndarray:
    """(n, s) whether the lines from zero to points (n, 2) cross segments (s, 2, 2)."""
    a, b = segments[:, 0], segments[:, 1]
    along = b - a
    x, y = points.T[:, :, None]
    side = (x * a[:, 1] - y * a[:, 0]) * (x * b[:, 1] - y * b[:, 0]) <= 0.0
    home = a[:, 1] * along[:, 0] - a[:, 0] * along[:, 1]
    there = home + along[:, 1] * x - along[:, 0] * y
    return side & (home * there < 0.0)
