"""Padded groups: many short lists of points as few arrays.

A group is an array with one line for each patch and about as many points in each line.
"""

from collections.abc import Iterator

import numpy as np

# Numbers of points that a line of a group may have. With twice as many, fewer lines are padded and
# there are more groups.
_WIDTHS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256])
# Largest numbers of pairs and of lines in a group, so that it fits the caches. Doubled, a group
# takes twice the memory.
_PAIRS, _LINES = 2048, 512


def runs(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and sizes (n,) of the runs of equal values in an array (m,).

    >>> [a.tolist() for a in runs(np.array([7, 7, 3, 7]))]
    [[0, 2, 3], [2, 1, 1]]
    """
    starts = np.flatnonzero(np.r_[True, values[1:] != values[:-1]][: len(values)])
    return starts, np.diff(np.r_[starts, len(values)])


def groups(rows: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Padded groups of equal rows: rows (m,), and indices (m, k) into ``rows``. Lines are padded
    with their last index.

    >>> [(r.tolist(), i.tolist()) for r, i in groups(np.array([5, 2, 5, 5]))]
    [([2], [[1]]), ([5], [[0, 2, 3]])]
    """
    narrow = len(rows) and rows.max() < 1 << 16
    # numpy sorts integers of 16 bits in linear time.
    order = np.argsort(rows.astype(np.uint16) if narrow else rows, kind="stable")
    ordered = rows[order]
    starts, counts = runs(ordered)
    lines = -(-counts // _WIDTHS[-1])
    place = np.arange(lines.sum()) - np.repeat(np.cumsum(lines) - lines, lines)
    starts = np.repeat(starts, lines) + place * _WIDTHS[-1]
    counts = np.minimum(np.repeat(counts, lines) - place * _WIDTHS[-1], _WIDTHS[-1])
    kind = np.searchsorted(_WIDTHS, counts)
    for k in np.unique(kind).tolist():
        of_kind, width = np.flatnonzero(kind == k), int(_WIDTHS[k])
        step = max(1, min(_LINES, _PAIRS // width))
        for i in range(0, len(of_kind), step):
            chosen = of_kind[i : i + step]
            inside = np.minimum(np.arange(width), counts[chosen, None] - 1)
            yield ordered[starts[chosen]], order[starts[chosen, None] + inside]
