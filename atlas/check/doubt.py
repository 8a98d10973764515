"""Doubt: something that speaks against an atlas, and where."""

from dataclasses import dataclass

import numpy as np

# Distance between places of one doubt, over the extent, and how many are named. Doubled, fewer or
# more places are named.
_APART, MOST = 0.1, 5
# The places of a doubt that concerns the whole.
NOWHERE = np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Doubt:
    """Something that speaks against an atlas.

    Parameters
    ----------
    name : str
        Short name, always the same for the same kind.
    words : str
        What was found and what to do, one sentence.
    places : (k, 3) float, length, world
        Where, five places at most; none where it concerns the whole.
    """

    name: str
    words: str
    places: np.ndarray

    def as_dict(self) -> dict:
        """The doubt, ready for JSON."""
        return {"name": self.name, "words": self.words, "places": self.places.tolist()}


def count_of(number: int, one: str, many: str) -> str:
    """A number and a noun in words."""
    return f"{number} {one if number == 1 else many}"


def extent_of(points) -> float:
    """Diagonal of the bounding box of points (n, 3), length."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def some_apart(points, extent: float) -> np.ndarray:
    """The first of points (n, 3) that are far from each other, five at most."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(((point - other) ** 2).sum() > (_APART * extent) ** 2 for other in kept):
            kept.append(point)
        if len(kept) == MOST:
            break
    return np.reshape(kept, (-1, 3))
