"""Blend: what an atlas knows of the surface at points."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.words import count_of


@dataclass(frozen=True, eq=False)
class Blend:
    """The surface at n query points.

    Parameters
    ----------
    distance : (n,) float, length
        First-order distance, positive outside; NaN where unknown, as are the next three.
    known : (n,) bool
        Whether samples show the surface near the point.
    normal : (n, 3) float, unit, world
        Outward.
    deviation : (n,) float, length
        Predicted standard deviation of the surface along the normal.
    gaussian_curvature : (n,) float, 1/length^2
    patch : (n,) int
        Id of the face that decides; -1 where unknown.
    """

    distance: np.ndarray
    known: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    gaussian_curvature: np.ndarray
    patch: np.ndarray

    def __repr__(self) -> str:
        """One line."""
        return (
            f"<Blend: {count_of(len(self.known), 'point')}, {int(self.known.sum())} of them known>"
        )

    @staticmethod
    def unknown(count: int) -> "Blend":
        """Of so many points where nothing is known."""
        none, nowhere = np.full(count, np.nan), np.full(count, -1)
        return Blend(none, nowhere > 0, np.full((count, 3), np.nan), none, none, nowhere)

    def without(self, index) -> "Blend":
        """The same, unknown at the points of indices (k,)."""
        if not len(index):
            return self
        columns = {name: column.copy() for name, column in vars(self).items()}
        for name, column in columns.items():
            column[index] = {"known": False, "patch": -1}.get(name, np.nan)
        return Blend(**columns)
