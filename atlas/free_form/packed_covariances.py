"""Covariances of many sextics in a sixth of the memory: their Cholesky factors in whole numbers.

The variance of a height with monomials t is t' C t = |U t|^2, where U is upper triangular and
C = U' U (Cholesky). Each number of U is kept as a whole number of two bytes, times a factor of its
column, the deviation of that coefficient, and one of its row.
"""

from copy import copy

import numpy as np

# Factors that are unpacked at once: they fit into the cache. At 1,000 it took four times as long.
_AT_ONCE = 48
# Largest whole number of two bytes. On a bottle and a torus variances change by 1e-5 in the median
# and 5e-3 at most.
_MOST = 32767
# What is kept of each covariance.
_BY_COVARIANCE = "_deviations", "_units", "_whole"


class PackedCovariances:
    """Covariance matrices of one size, packed.

    Parameters
    ----------
    factors : (m, t, t) float
        Upper triangular U of covariances U' U.

    Examples
    --------
    >>> packed = PackedCovariances(np.array([[[2.0, 1.0], [0.0, 2.0]]]))
    >>> packed.covariance(0).round(3).tolist()
    [[4.0, 2.0], [2.0, 5.0]]
    >>> packed.variances(np.array([0]), np.array([[[1.0], [1.0]]])).round(3).tolist()
    [[13.0]]
    """

    def __init__(self, factors) -> None:
        self._size = factors.shape[2]
        tiny = np.finfo(np.float32).tiny
        self._deviations = np.maximum(np.sqrt((factors**2).sum(axis=1)), tiny).astype(np.float32)
        scaled = factors / self._deviations[:, None]
        self._units = np.maximum(np.abs(scaled).max(axis=2) / _MOST, tiny).astype(np.float32)
        rows, columns = np.triu_indices(self._size)
        whole = np.rint(scaled[:, rows, columns] / self._units[:, rows])
        self._whole = whole.clip(-_MOST, _MOST).astype(np.int16)
        self._places = rows * self._size + columns

    def some(self, index) -> "PackedCovariances":
        """Some of them (k,), as they are packed."""
        found = copy(self)
        for name in _BY_COVARIANCE:
            setattr(found, name, getattr(self, name)[index])
        return found

    @staticmethod
    def joined(parts: "list[PackedCovariances]") -> "PackedCovariances":
        """Those of all parts, as they are packed."""
        found = copy(parts[0])
        for name in _BY_COVARIANCE:
            setattr(found, name, np.concatenate([getattr(part, name) for part in parts]))
        return found

    def variances(self, which, terms) -> np.ndarray:
        """(g, n) variances of combinations ``terms`` (g, t, n) of what each of some covariances,
        ``which`` (g,), is of."""
        out = np.empty((len(which), terms.shape[2]))
        for start in range(0, len(which), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            white = self._factors(which[some]) @ terms[some].astype(np.float32)
            out[some] = (white * white).sum(axis=1)
        return out

    def covariance(self, which: int) -> np.ndarray:
        """(t, t) one of the covariances."""
        [factor] = self._factors(np.array([which])).astype(float)
        return np.asarray(factor.T @ factor)

    def _factors(self, which) -> np.ndarray:
        """(g, t, t) upper factors of some covariances."""
        out = np.zeros((len(which), self._size**2), np.float32)
        out[:, self._places] = self._whole[which]
        out = out.reshape(-1, self._size, self._size) * self._units[which, :, None]
        return out * self._deviations[which, None]
