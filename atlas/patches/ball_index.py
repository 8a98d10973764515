"""BallIndex: which balls contain a point, as balls are inserted, moved and removed."""

import numpy as np

# The 27 cells that a ball can touch, as steps from the lowest.
_STEPS = np.array([[i, j, k] for i in range(3) for j in range(3) for k in range(3)])
# Factors of the three coordinates of a cell in its hash: Teschner et al., Optimized spatial hashing
# for collision detection of deformable objects, 2003.
_PRIMES = np.array([73856093, 19349663, 83492791], np.uint64)
# Factors of the level and of the sum: 2^32 and 2^64 over the golden ratio spread differences of the
# low bits over the high ones (Knuth, volume 3, section 6.4).
_LEVEL_PRIME, _GOLDEN = np.uint64(2654435761), np.uint64(0x9E3779B97F4A7C15)
# Largest number of balls for each bucket of the hash table. Doubled, the table takes half the space
# and a look-up finds twice as many candidates of other cells.
_LOAD = 2
# Slots that one numpy call compares. Doubled, a call takes twice the memory.
_AT_ONCE = 1 << 20
# Factor of the side of a cell where it is compared with a ball, so that rounding loses no ball.
# Doubled, there are more candidates and the same result.
_SLACK = 1.01
# Number of balls up to which comparing all is faster than looking up cells. Doubled, look-ups in
# tables of that size are slower.
_FEW = 1024
# Largest cell number: larger ones do not fit into 64 bits.
_FARTHEST = 2.0**62
# Limit below which whole numbers are exact as floats.
_EXACT = 2.0**52


class BallIndex:
    """Balls (row, centre, radius) in a hash table of grids, one grid for each octave of radius.

    A ball is entered in the cells that it touches, 27 at most: their side is 1 to 2 radii. A point
    looks into one cell of each grid. Different cells may share a bucket; the test of the distance
    removes the candidates that this adds. The index works in any unit of length.

    Examples
    --------
    >>> index = BallIndex()
    >>> index.insert(7, [0.0, 0.0, 0.0], 1.0)
    >>> [a.tolist() for a in index.near(np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 2.0]]))]
    [[7], [0]]
    """

    def __init__(self) -> None:
        self._centre, self._radius = np.zeros((64, 3)), np.full(64, -1.0)
        self._level = np.zeros(64, np.int16)
        self._slots, self._count = np.full((16, 8), -1, np.int32), np.zeros(16, np.int32)
        self._levels: dict[int, int] = {}
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def __contains__(self, row: int) -> bool:
        return 0 <= row < len(self._radius) and self._radius[row] >= 0.0

    def rows(self) -> np.ndarray:
        """All rows, ascending."""
        return np.flatnonzero(self._radius >= 0.0)

    def insert(self, row: int, centre, radius: float) -> None:
        """Insert a ball; ValueError when the row is in the index, or the ball is not finite."""
        centre = np.asarray(centre, dtype=float)
        if row in self or not (np.isfinite(centre).all() and 0.0 < radius < np.inf):
            raise ValueError(
                f"row, centre, radius are {row}, {centre}, {radius}; a row not yet in the index, "
                "a finite centre and a radius > 0 are needed: remove or move the old ball"
            )
        while row >= len(self._radius):
            self._centre = np.concatenate([self._centre, np.zeros_like(self._centre)])
            self._radius = np.concatenate([self._radius, np.full_like(self._radius, -1.0)])
            self._level = np.concatenate([self._level, np.zeros_like(self._level)])
        level = int(np.ceil(np.log2(radius)))
        self._centre[row], self._radius[row], self._level[row] = centre, radius, level
        self._levels[level] = self._levels.get(level, 0) + 1
        self._size += 1
        if self._size > _LOAD * len(self._count):
            self._grow()
        else:
            self._enter(row)

    def remove(self, row: int) -> None:
        """Remove a ball; KeyError when it is not in the index."""
        if row not in self:
            raise KeyError(f"row {row} is not in the index")
        for bucket in self._buckets_of(row):
            last = self._count[bucket] - 1
            slots = self._slots[bucket]
            slots[np.flatnonzero(slots[: last + 1] == row)[0]] = slots[last]
            slots[last], self._count[bucket] = -1, last
        level = int(self._level[row])
        self._levels[level] -= 1
        if not self._levels[level]:
            del self._levels[level]
        self._radius[row] = -1.0
        self._size -= 1

    def move(self, row: int, centre, radius: float) -> None:
        """Change centre and radius of a ball."""
        self.remove(row)
        self.insert(row, centre, radius)

    def near(self, points) -> tuple[np.ndarray, np.ndarray]:
        """All pairs of a ball and a point in it.

        Parameters
        ----------
        points : (n, 3) float, length

        Returns
        -------
        rows, which : (m,) int
            Row of the ball and index of the point, sorted by point, then by row.
        """
        points = np.asarray(points, dtype=float)
        step = max(1, _AT_ONCE // (self._slots.shape[1] * max(1, len(self._levels))))
        parts = [self._near(points[i : i + step], i) for i in range(0, len(points), step)]
        if not parts:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        rows, which = (np.concatenate(part) for part in zip(*parts, strict=True))
        return rows, which

    def rows_near(self, centre, radius: float) -> np.ndarray:
        """Rows, ascending, of the balls that intersect the open ball with this centre (3,) and
        radius."""
        centre = np.asarray(centre, dtype=float)
        rows = self._candidates(centre, radius)
        offset = self._centre[rows] - centre
        reach = np.where(self._radius[rows] >= 0.0, self._radius[rows] + radius, 0.0)
        return rows[(offset * offset).sum(axis=1) < reach * reach]

    def _candidates(self, centre, radius: float) -> np.ndarray:
        """Rows, ascending, that may intersect a ball; all rows where that is faster."""
        if self._size <= _FEW:
            return self.rows()
        buckets = []
        for level in self._levels:
            side = 2.0**level
            low = np.floor((centre - radius) / side)
            span = np.floor((centre + radius) / side) - low + 1.0
            if span.prod() > max(64, self._size):
                return self.rows()
            cells = np.indices(span.astype(int)).reshape(3, -1).T + _cells(centre - radius, level)
            buckets.append(self._bucket(cells, level))
        if not buckets:
            return np.zeros(0, int)
        found = np.unique(self._slots[np.concatenate(buckets)])
        return found[found >= 0].astype(int)

    def _near(self, points, first: int):
        """Pairs of balls and the points (n, 3), whose indices start at ``first``."""
        parts = [self._near_on(points, level) for level in self._levels]
        if not parts:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        row, here = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(here * len(self._radius) + row)
        return row[order], here[order] + first

    def _near_on(self, points, level: int):
        """Pairs (rows, which) of a level's balls and the points in them."""
        # One look-up serves all points of a cell.
        side = 2.0**level
        centres, order, starts, counts = _shared_cells(points, side)
        row, cell = self._touching(centres, 0.5 * side, level)
        many = counts[cell]
        row = np.repeat(row, many)
        place = np.arange(len(row)) - np.repeat(np.cumsum(many) - many, many)
        here = order[np.repeat(starts[cell], many) + place]
        offset = points[here] - self._centre[row]
        inside = np.einsum("ij,ij->i", offset, offset) <= self._radius[row] ** 2
        return row[inside], here[inside]

    def _touching(self, centres, half: float, level: int):
        """Pairs (rows, which) of a level's balls and the cells that they touch, given the centres
        (n, 3) and the half side of the cells."""
        bucket = self._bucket(_cells(centres, level), level)
        slots = self._slots[bucket, : self._count[bucket].max(initial=0)]
        here, slot = np.nonzero(slots >= 0)
        row = slots[here, slot].astype(np.int64)
        near = self._level[row] == level
        row, here = row[near], here[near]
        offset = np.maximum(np.abs(centres[here] - self._centre[row]) - _SLACK * half, 0.0)
        touching = np.einsum("ij,ij->i", offset, offset) <= self._radius[row] ** 2
        return row[touching], here[touching]

    def _bucket(self, cells, level: int) -> np.ndarray:
        """(n,) bucket of each cell (n, 3) of a level."""
        mixed = (cells.astype(np.uint64) * _PRIMES).sum(axis=1, dtype=np.uint64)
        mixed = (mixed + np.uint64(level % 4096) * _LEVEL_PRIME) * _GOLDEN
        return (mixed >> np.uint64(65 - len(self._count).bit_length())).astype(np.int64)

    def _buckets_of(self, row: int) -> list[int]:
        """The buckets of the cells that a ball touches, each once."""
        level, radius = int(self._level[row]), self._radius[row]
        low = _cells(self._centre[row] - radius, level)
        high = _cells(self._centre[row] + radius, level)
        return sorted(set(self._bucket(np.minimum(low + _STEPS, high), level).tolist()))

    def _enter(self, row: int) -> None:
        """Write a row into its buckets."""
        for bucket in self._buckets_of(row):
            last = self._count[bucket]
            if last == self._slots.shape[1]:
                self._slots = np.concatenate([self._slots, np.full_like(self._slots, -1)], axis=1)
            self._slots[bucket, last] = row
            self._count[bucket] = last + 1

    def _grow(self) -> None:
        """Double the number of buckets."""
        count = 2 * len(self._count)
        self._slots, self._count = np.full((count, 8), -1, np.int32), np.zeros(count, np.int32)
        for row in self.rows().tolist():
            self._enter(row)


def _cells(points, level: int) -> np.ndarray:
    """(..., 3) cells of a level that hold points (..., 3); the outermost cells are unbounded."""
    return np.clip(np.floor(points / 2.0**level), -_FARTHEST, _FARTHEST).astype(np.int64)


def _shared_cells(points, side: float):
    """The cells that hold points (n, 3): their centres (m, 3), the indices of the points (n,)
    cell by cell, and for each cell the first place (m,) and the number (m,) of its points."""
    cells = np.floor(points / side)
    low = cells.min(axis=0)
    span = cells.max(axis=0) - low + 1.0
    if not span.prod() < _EXACT:
        # Cells this far apart cannot be numbered: every point is its own cell.
        each = np.arange(len(points))
        return points, each, each, np.ones_like(each)
    key = ((cells - low) @ [1.0, span[0], span[0] * span[1]]).astype(np.int64)
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    counts = np.diff(np.r_[starts, len(points)])
    return (cells[order[starts]] + 0.5) * side, order, starts, counts
