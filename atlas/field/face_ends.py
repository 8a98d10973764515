"""FaceEnds: the edges at which faces end, and values of faces combined across them."""

import numpy as np


class FaceEnds:
    """Edges of one sign, convex or concave, at which faces end.

    Parameters
    ----------
    pairs : list of (int, int)
        The face that ends, and the other one.

    Examples
    --------
    Face 0 ends at face 1:

    >>> FaceEnds([(0, 1)]).combine(np.maximum, np.array([[1, 5]]), np.array([[7, 3]]))
    array([[3, 5]])
    """

    def __init__(self, pairs: list[tuple[int, int]]) -> None:
        self.pairs = sorted(pairs)
        ended, self._others = np.reshape(self.pairs, (-1, 2)).astype(int).T
        self._faces, self._starts = np.unique(ended, return_index=True)

    def combine(self, ufunc: np.ufunc, own, beyond) -> np.ndarray:
        """(n, f) values ``own`` (n, f) of faces, each combined with those ``beyond`` (n, f) of the
        faces at which it ends."""
        out = own.copy()
        others = ufunc.reduceat(beyond.T[self._others], self._starts)
        out[:, self._faces] = ufunc(own[:, self._faces], others.T)
        return np.asarray(out)
