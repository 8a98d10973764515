"""Creases: the edges along which two sheets meet, and where a patch's domain ends at them.

The surface goes on across a crease, but no polynomial does: patches on its two sides are not
kin. A patch claims what can be seen from its centre, over its tangent plane, without looking
across a crease of its own sheet.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.crease_curves import Source, crease_curves, sources_of
from touchatlas.atlas.graph.power_diagram import CREASE_ANGLE
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# Patches that were once creased stay so down to this share of the angle, and this far beyond
# their radii: else they would flicker as they learn.
_HOLDS, _REACH = 0.6, 1.1
# Segments of creases farther out than this, in patch radii, are not looked at.
_FAR = 1.3
# A patch is seen from at least so far inside of its creases, in patch radii.
_CLEAR = 0.05
_AT_ONCE = 1 << 21
# Outlines are looked at so far out: on the crease itself either answer is right.
_INNER = 0.95


@dataclass(frozen=True, eq=False)
class Crease:
    """How two patches are creased.

    Parameters
    ----------
    sign : int
        1 for a convex edge, -1 for a concave one.
    anchor : (3,) float, length, world
        Point on both patches near which both were touched.
    """

    sign: int
    anchor: np.ndarray


class Creases:
    """Which patches meet at sharp edges, kept beside ``neighbours``.

    Parameters
    ----------
    table : Table
    neighbours : Kin
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours) -> None:
        self._table, self._kin = table, neighbours
        self._pairs: dict[tuple[int, int], Crease] = {}
        self._partners: dict[int, set[int]] = {}
        self._curves: dict[tuple[int, int], np.ndarray] = {}
        self._sources: dict[tuple[int, int], Source] = {}
        self._current: set[tuple[int, int]] = set()
        self._segments: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._centres: dict[int, np.ndarray] = {}

    def __len__(self) -> int:
        return len(self._pairs)

    @property
    def pairs(self) -> dict[tuple[int, int], Crease]:
        """Ascending pairs of rows, and how they are creased."""
        return self._pairs

    def of(self, row: int) -> set[int]:
        """The rows that a row is creased with."""
        return self._partners.get(row, set())

    def neighbours_of(self, row: int) -> set[int]:
        """The kin of a row."""
        return self._kin[row]

    def of_all(self, rows) -> dict[int, Crease]:
        """The rows that any of some rows are creased with, but none of these, and one of the
        creases with each."""
        found = {j: self.between(i, j) for i in rows for j in sorted(self.of(i) - set(rows))}
        return {j: crease for j, crease in found.items() if crease is not None}

    def between(self, first: int, second: int) -> Crease | None:
        """How two rows are creased; None when they are not."""
        return self._pairs.get((min(first, second), max(first, second)))

    def sign(self, first: int, second: int) -> int:
        """1 where two rows make a convex edge, -1 a concave one, 0 none."""
        crease = self.between(first, second)
        return crease.sign if crease else 0

    def behind(self, row: int) -> dict[int, int]:
        """The rows that the sheet of a row is creased with, it or one of its kin, and the sign
        with each: that of the row itself where it is creased with it."""
        neighbours, signs = self._kin[row], dict[int, int]()
        for i in (row, *sorted(neighbours)):
            for j in self.of(i) - signs.keys():
                signs[j] = self.sign(i, j)
        return {j: sign for j, sign in signs.items() if j != row and j not in neighbours}

    def enter(self, first: int, second: int, crease: Crease) -> None:
        """Make two rows creased."""
        self._pairs[min(first, second), max(first, second)] = crease
        self._partners.setdefault(first, set()).add(second)
        self._partners.setdefault(second, set()).add(first)
        self.touch([first, second])

    def forget(self, rows) -> None:
        """Rows that are no more have no crease."""
        for i in rows:
            self.touch([i])
            for j in self._partners.pop(i, set()):
                del self._pairs[min(i, j), max(i, j)]
                self._partners[j].discard(i)

    def touch(self, rows) -> None:
        """Curves about rows that changed are to be drawn anew, where what they follow from did."""
        stale = set(rows).union(*(self._kin[i] for i in rows if i < len(self._kin)))
        stale = stale.union(*(self.of(i) for i in stale))
        self._current = {pair for pair in self._current if stale.isdisjoint(pair)}
        self._segments.clear()
        self._centres.clear()

    def renew(self, rows) -> None:
        """Move the anchors of rows that changed; drop creases that are none any more."""
        pairs = sorted({(min(i, j), max(i, j)) for i in rows for j in self.of(i)})
        if not pairs:
            return
        table, both = self._table, np.array(pairs)
        seen = intersect(table, both, np.array([self._pairs[pair].anchor for pair in pairs]))
        cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
        holds = np.abs(cosine) <= np.cos(_HOLDS * CREASE_ANGLE)
        holds &= (seen.across <= _REACH).all(axis=1)
        holds &= np.abs(seen.distance).max(axis=1) <= 1e-6 * table.radius[both].min(axis=1)
        for pair, good, point in zip(pairs, holds, seen.points, strict=True):
            if good:
                self._pairs[pair] = Crease(self._pairs[pair].sign, point)
            else:
                del self._pairs[pair]
                self._partners[pair[0]].discard(pair[1])
                self._partners[pair[1]].discard(pair[0])
        self.touch(rows)

    def curve(self, first: int, second: int) -> np.ndarray:
        """(n, 3) points along the crease of two rows, as far as both reach and no third sheet
        cuts it off."""
        pair = min(first, second), max(first, second)
        if pair not in self._current:
            self._draw()
        return self._curves[pair]

    def _draw(self) -> None:
        """Draw the curves that are not current, but for those that would be as they were."""
        stale = sorted(set(self._pairs) - self._current)
        sources = sources_of(self._table, self, stale)
        anew = [source for source in sources if self._sources.get(source.pair) != source]
        lines = dict(self._curves)
        for source, line in zip(anew, crease_curves(self._table, anew), strict=True):
            self._sources[source.pair], lines[source.pair] = source, line
        self._sources = {pair: self._sources[pair] for pair in self._pairs}
        self._curves = {pair: lines[pair] for pair in self._pairs}
        self._current = set(self._pairs)

    def usual_length(self) -> float:
        """Median over the creases of the distance between their ends; infinite without any."""
        lines = [self.curve(*pair) for pair in self._pairs]
        ends = np.array([line[-1] - line[0] for line in lines if len(line)]).reshape(-1, 3)
        return float(np.median(np.sqrt((ends * ends).sum(axis=1)))) if len(ends) else np.inf

    def beyond(self, rows, points) -> np.ndarray:
        """(m,) whether points (m, 3) on patches ``rows`` (m,) lie beyond a crease of theirs."""
        rows = np.asarray(rows)
        out = np.zeros(len(rows), bool)
        if not self._pairs or not len(rows):
            return out
        for row in np.unique(rows).tolist():
            segments, _ = self._segments_of(row)
            if len(segments):
                here = np.flatnonzero(rows == row)
                flat = self._flat(row, points[here])
                step = max(1, _AT_ONCE // len(segments))
                for i in range(0, len(here), step):
                    crossed = _crossed(flat[i : i + step], segments)
                    out[here[i : i + step]] = crossed.any(axis=1)
        return out

    def crossed(self, rows, points) -> list[set[int]]:
        """For each of points (m, 3) on patches ``rows`` (m,) the patches behind the creases that
        it lies beyond."""
        out: list[set[int]] = [set() for _ in rows]
        for row in np.unique(rows).tolist():
            segments, partners = self._segments_of(row)
            here = np.flatnonzero(rows == row)
            at, which = np.nonzero(_crossed(self._flat(row, points[here]), segments))
            for i, j in zip(here[at].tolist(), partners[which].tolist(), strict=True):
                out[i].add(j)
        return out

    def sees(self, rows, feet, own) -> np.ndarray:
        """(m,) which of the pairs ``own`` (m,) of a patch and a foot (m, 3) on it lie on this
        side of all creases."""
        out, some = own.copy(), np.flatnonzero(own)
        out[some] = ~self.beyond(np.asarray(rows)[some], feet[some])
        return out

    def hides(self, row: int, rows) -> bool:
        """Whether a part of the outlines of creased ``rows`` cannot be seen from the centre of a
        new row that is to take their place."""
        pieces = self._pieces(rows)
        if not len(pieces):
            return False
        places = []
        for i in rows:
            ring = self._table.outline[i]
            beyond = self._behind(i, ring, pieces)
            places.append(np.concatenate([ring[~beyond], self._centre(i)[None]]))
        hidden = self._behind(row, np.concatenate(places), pieces, _INNER).any()
        # One that is refused leaves its number to the next, whose centre is elsewhere.
        del self._centres[row]
        return bool(hidden)

    def seen_instead(self, row: int, rows, points) -> np.ndarray:
        """(n,) whether points (n, 3) of a new row that is to take the place of ``rows`` can be
        seen from its centre."""
        pieces = self._pieces(rows)
        if not len(pieces):
            return np.ones(len(points), bool)
        seen = ~self._behind(row, points, pieces)
        del self._centres[row]
        return seen

    def _pieces(self, rows) -> np.ndarray:
        """(s, 2, 3) the creases of the sheet of some rows as segments."""
        sheet = sorted(set(rows).union(*(self._kin[i] for i in rows)))
        lines = [self.curve(i, j) for i in sheet for j in sorted(self.of(i))]
        pieces = [np.stack([a[:-1], a[1:]], axis=1) for a in lines if len(a)]
        return np.concatenate(pieces) if pieces else np.zeros((0, 2, 3))

    def _behind(self, row: int, points, pieces, share: float = 1.0) -> np.ndarray:
        """(n,) whether segments (s, 2, 3) are before points (n, 3), seen from the centre of a row,
        or before what lies a ``share`` of the way to them."""
        segments = self._flat(row, pieces.reshape(-1, 3)).reshape(-1, 2, 2)
        crossed = _crossed(share * self._flat(row, points), segments)
        return np.asarray(crossed.any(axis=1))

    def _flat(self, row: int, points) -> np.ndarray:
        """(n, 2) points over the tangent plane of a row, from its centre, in patch radii."""
        table = self._table
        return (points - self._centre(row)) @ table.axes[row, :2].T / table.radius[row]

    def _centre(self, row: int) -> np.ndarray:
        """(3,) the site of a row, or where that is on a crease or beyond a point inside of it."""
        if row not in self._centres:
            table, centre = self._table, self._table.site[row].copy()
            for j in sorted(self.of(row)):
                seen = patches_at(table, np.array([[j]]), centre[None])
                sign, off = self.sign(row, j), float(seen.distance[0, 0])
                inside = sign * off + _CLEAR * table.radius[row]
                if inside > 0.0 and seen.across[0, 0] <= 1.0:
                    centre -= sign * inside * seen.normals[0, 0]
            self._centres[row] = centre
        return self._centres[row]

    def _segments_of(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """The creases of a row's sheet as segments (s, 2, 2) over its tangent plane, and the
        patch (s,) behind each."""
        if row not in self._segments:
            mine = self.of(row)
            pairs = [(row, j) for j in sorted(mine)]
            pairs += [(k, j) for k in self._kin[row] for j in sorted(self.of(k) - mine)]
            lines = [self.curve(*pair) for pair in pairs]
            which = np.repeat(np.arange(len(lines)), np.array([len(a) for a in lines], int))
            flat = self._flat(row, np.concatenate([np.zeros((0, 3)), *lines]))
            segments = np.stack([flat[:-1], flat[1:]], axis=1)
            kept = ((segments * segments).sum(axis=2) <= _FAR**2).any(axis=1)
            kept &= which[:-1] == which[1:]
            partners = np.array([j for _, j in pairs], int)[which[:-1][kept]]
            self._segments[row] = segments[kept], partners
        return self._segments[row]


def _crossed(points, segments) -> np.ndarray:
    """(n, s) whether the ways from zero to points (n, 2) cross segments (s, 2, 2)."""
    a, b = segments[:, 0], segments[:, 1]
    along = b - a
    x, y = points.T[:, :, None]
    side = (x * a[:, 1] - y * a[:, 0]) * (x * b[:, 1] - y * b[:, 0]) <= 0.0
    home = a[:, 1] * along[:, 0] - a[:, 0] * along[:, 1]
    there = home + along[:, 1] * x - along[:, 0] * y
    return side & (home * there < 0.0)
