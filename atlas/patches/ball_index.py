"""BallIndex: which balls contain a point, as balls are inserted, moved and removed.

Balls of about one size, within a factor of two, share a k-d tree of their centres. A tree is
rebuilt when many of its balls have changed; until then a second tree holds the changed ones.
"""

import numpy as np
from scipy.spatial import cKDTree

# Number of changed balls, and fraction of all balls of a tree, beyond which it is rebuilt. Doubled,
# changes take less time and queries more.
_CHANGED, _FRACTION = 32, 0.125
# Number of points in one query: their pairs take 100 MB at ten balls each. Doubled, they take twice
# the memory.
_AT_ONCE = 1 << 18
# Factor of the distances that trees are queried for, against rounding; the pairs are checked later.
# Doubling the excess changes nothing.
_SLACK = 1.0 + 1e-9
# A level that no ball has, because double precision ends before it.
_NOWHERE = 1 << 20


class _Tree:
    """Centres of the balls of one size.

    Parameters
    ----------
    level : int
        The size: see ``_level``.

    Attributes
    ----------
    rows : (n,) int
        Rows of the points of the tree. Some of their balls may have been moved or removed.
    changed : set of int
        Rows that were inserted or moved since the tree was built.
    """

    def __init__(self, level: int) -> None:
        self.rows, self.changed = np.zeros(0, np.int64), set[int]()
        self._level = level
        self._built: cKDTree | None = None
        # The rows that changed and the tree of their centres, until others change.
        self._second: tuple[np.ndarray, cKDTree] | None = None

    def change(self, row: int) -> None:
        """A ball of this size was inserted or moved."""
        self.changed.add(row)
        self._second = None

    def discard(self, row: int) -> None:
        """A ball of this size was removed."""
        self.changed.discard(row)
        self._second = None

    def parts(self, index: "BallIndex"):
        """One or two trees, each with the rows of its points, that together hold all balls."""
        if len(self.changed) > max(_CHANGED, _FRACTION * len(self.rows)):
            kept = self.rows[index.built[self.rows] == self._level].tolist()
            self.rows = np.array(sorted({*kept, *self.changed}), np.int64)
            self._built = cKDTree(index.centre[self.rows])
            index.built[self.rows] = self._level
            self.changed.clear()
            self._second = None
        if self._built is not None:
            yield self._built, self.rows
        if self.changed:
            if self._second is None:
                rows = np.array(sorted(self.changed), np.int64)
                self._second = rows, cKDTree(index.centre[rows])
            rows, tree = self._second
            yield tree, rows


class BallIndex:
    """Balls with row numbers, found by the points in them.

    Attributes
    ----------
    centre : (m, 3) float, length
    radius : (m,) float, length
        -1 where a row has no ball.
    built : (m,) int
        Level of the built tree that holds the ball at its present centre; else _NOWHERE.

    Examples
    --------
    >>> index = BallIndex()
    >>> index.insert(0, [0, 0, 0], 1.0)
    >>> index.insert(7, [2, 0, 0], 1.5)
    >>> [found.tolist() for found in index.near([[0.7, 0, 0], [9, 0, 0]])]
    [[0, 7], [0, 0]]
    >>> index.rows_near([-1, 0, 0], 0.5).tolist()
    [0]
    """

    def __init__(self) -> None:
        self.centre, self.radius = np.zeros((64, 3)), np.full(64, -1.0)
        self.built = np.full(64, _NOWHERE)
        self._trees: dict[int, _Tree] = {}

    def __len__(self) -> int:
        return int(np.count_nonzero(self.radius >= 0.0))

    def __contains__(self, row) -> bool:
        return bool(0 <= row < len(self.radius) and self.radius[row] >= 0.0)

    def rows(self) -> np.ndarray:
        """The rows with a ball, ascending."""
        return np.flatnonzero(self.radius >= 0.0)

    def insert(self, row: int, centre, radius: float) -> None:
        """Insert a ball; ValueError when the row is in the index, or the ball is not finite."""
        centre = np.asarray(centre, dtype=float)
        if row in self or not (np.isfinite(centre).all() and 0.0 < radius < np.inf):
            raise ValueError(
                f"row, centre, radius are {row}, {centre}, {radius}; a row not yet in the index, "
                "a finite centre and a radius > 0 are needed: remove or move the old ball"
            )
        while row >= len(self.radius):
            self.centre = np.concatenate([self.centre, np.zeros_like(self.centre)])
            self.radius = np.concatenate([self.radius, np.full_like(self.radius, -1.0)])
            self.built = np.concatenate([self.built, np.full_like(self.built, _NOWHERE)])
        self.centre[row], self.radius[row] = centre, radius
        level = _level(radius)
        self._trees.setdefault(level, _Tree(level)).change(row)

    def remove(self, row: int) -> None:
        """Remove a ball; KeyError when it is not in the index."""
        if row not in self:
            raise KeyError(f"row {row} is not in the index")
        self._trees[_level(self.radius[row])].discard(row)
        self.radius[row], self.built[row] = -1.0, _NOWHERE

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
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        found = [(np.zeros(0, np.int64), np.zeros(0, np.int64))]
        for first in range(0, len(points), _AT_ONCE):
            some = points[first : first + _AT_ONCE]
            tree = cKDTree(some)
            pairs = [self._pairs(tree, some, *part) for part in self._parts()]
            row, which = (np.concatenate(c) for c in zip(*(found[:1] + pairs), strict=True))
            order = np.argsort(which * len(self.radius) + row)
            found.append((row[order], which[order] + first))
        rows, which = (np.concatenate(column) for column in zip(*found, strict=True))
        return rows, which

    def rows_near(self, centre, radius: float) -> np.ndarray:
        """Rows, ascending, of the balls that intersect the open ball with this centre (3,) and
        radius."""
        centre = np.asarray(centre, dtype=float)
        parts = [
            rows[tree.query_ball_point(centre, (radius + 2.0**level) * _SLACK)]
            for level, _, tree, rows in self._parts()
        ]
        rows = np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
        offset = self.centre[rows] - centre
        reach = np.where(self.radius[rows] >= 0.0, self.radius[rows] + radius, 0.0)
        return rows[(offset * offset).sum(axis=1) < reach * reach]

    def _parts(self):
        """For each tree its level, whether its balls may have changed since it was built, the tree,
        and the rows of its points."""
        for level, tree in self._trees.items():
            for part, rows in tree.parts(self):
                yield level, rows is tree.rows, part, rows

    def _pairs(self, tree: cKDTree, points, level: int, is_old: bool, centres: cKDTree, rows):
        """Pairs (rows, which) of the balls of one tree ``centres`` and the points in them; ``tree``
        holds the points."""
        reach = 2.0**level * _SLACK
        near = tree.sparse_distance_matrix(centres, reach, output_type="ndarray")
        which, row = near["i"].astype(np.int64), rows[near["j"]]
        offset = points[which] - self.centre[row]
        inside = np.einsum("ij,ij->i", offset, offset) <= self.radius[row] ** 2
        inside &= ~np.asarray(is_old) | (self.built[row] == level)
        return row[inside], which[inside]


def _level(radius: float) -> int:
    """The size of a ball: the exponent of the least power of two not below its radius."""
    return int(np.ceil(np.log2(radius)))
