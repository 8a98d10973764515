"""Products of the monomials of a basis: a symmetric matrix over them as one polynomial.

The product of two monomials is a monomial of at most twice the degree, and many pairs have the
same product. So phi^t A phi is one polynomial: it has 93 coefficients where A has 441. Likewise
the sums of w phi phi^t over samples hold 93 different moments: a Hankel matrix in three variables.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from touchatlas.patch.geometry.polynomial import Basis


@dataclass(frozen=True, eq=False)
class Products:
    """The p different products of two of t monomials.

    Parameters
    ----------
    place : (t, t) int
        Number of the product of each pair.
    pairs : (t * t,) int
        The pairs, as indices into a flattened (t, t) matrix, in the order of their products.
    starts : (p,) int
        Where the pairs of each product begin in ``pairs``.
    heads : (h,) int
        Few monomials such that every product is one of them times some monomial.
    slots : (p,) int
        Where each product is in the flattened (h, t) products of heads and monomials.
    """

    place: np.ndarray
    pairs: np.ndarray
    starts: np.ndarray
    heads: np.ndarray
    slots: np.ndarray

    def quadratic_forms(self, matrices) -> np.ndarray:
        """(..., p) coefficients of the polynomials phi^t A phi of matrices A (..., t, t)."""
        flat = matrices.reshape(*matrices.shape[:-2], len(self.pairs))
        return np.add.reduceat(flat[..., self.pairs], self.starts, axis=-1)

    def values(self, coefficients, terms) -> np.ndarray:
        """(m, n) values of m such polynomials (m, p), each at n points with monomials (m, t, n)."""
        lines = np.zeros((len(terms), len(self.heads) * len(self.place)))
        lines[:, self.slots] = coefficients
        inner = lines.reshape(len(terms), len(self.heads), -1) @ terms
        return np.einsum("mhn,mhn->mn", inner, terms[:, self.heads])

    def moments(self, terms, weight) -> np.ndarray:
        """(m, p) sums over n points of the products of monomials (m, t, n), weighted (m, n)."""
        sums = (terms[:, self.heads] * weight[:, None]) @ terms.transpose(0, 2, 1)
        return sums.reshape(len(terms), -1)[:, self.slots]

    def gram(self, moments) -> np.ndarray:
        """(..., t, t) sums of w phi phi^t, from their moments (..., p).

        >>> from touchatlas.patch.geometry.polynomial import monge_basis
        >>> products(monge_basis(1)).gram(np.array([9, 1, 2, 3, 4, 5])).tolist()
        [[9, 3, 1], [3, 5, 4], [1, 4, 2]]
        """
        return moments[..., self.place]


@lru_cache
def products(basis: Basis) -> Products:
    """The products of the monomials of a basis.

    >>> from touchatlas.patch.geometry.polynomial import graded_basis
    >>> of = products(graded_basis(4))
    >>> len(of.starts), graded_basis(4).exponents[of.heads].tolist()[:4]
    (93, [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 2]])
    """
    sums = (basis.exponents[:, None] + basis.exponents).reshape(-1, 3)
    _, place = np.unique(sums, axis=0, return_inverse=True)
    place = place.reshape(basis.size, basis.size)
    pairs = np.argsort(place, axis=None, kind="stable")
    starts = np.flatnonzero(np.diff(place.ravel()[pairs], prepend=-1))
    heads, left = [], set(range(len(starts)))
    while left:
        # Greedy set cover: the monomial with the most products that no head has yet.
        heads.append(int(np.argmax([len(left & set(line)) for line in place.tolist()])))
        left -= set(place[heads[-1]].tolist())
    _, slots = np.unique(place[heads], return_index=True)
    return Products(place, pairs, starts, np.array(heads), slots)
