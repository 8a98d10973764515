"""Ascending pairs and triples of rows: the keys of boundaries and corners."""

from collections.abc import Iterable

Pair = tuple[int, int]
Triple = tuple[int, int, int]


def pair_of(first: int, second: int) -> Pair:
    """Two rows, ascending."""
    return min(first, second), max(first, second)


def triple_of(rows: Iterable[int]) -> Triple:
    """Three rows, ascending."""
    low, middle, high = sorted(rows)
    return low, middle, high
