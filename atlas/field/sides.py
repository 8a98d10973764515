"""Sides: on which sides of faces, extended without end, points lie, and what votes say of that."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Sides:
    """On which sides of f faces n points lie.

    Parameters
    ----------
    distances : (n, f) float, length
        Signed, from the surfaces; of several faces that are one, from that with the nearest sample.
    outside : (n, f) bool
        Whether each lies on the outer side.
    off : (n, f) float, length
        How far each face is at least, with its ends.
    order : (n, k) int
        The nearest faces, by how far they are.
    label : (n,) float
        Of the cell of each point: 1 outside of the body, -1 inside, 0 unknown.
    """

    distances: np.ndarray
    outside: np.ndarray
    off: np.ndarray
    order: np.ndarray
    label: np.ndarray

    def some(self, rows) -> "Sides":
        """The same of some of the points (m,)."""
        return Sides(*(column[rows] for column in vars(self).values()))
