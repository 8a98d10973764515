"""The prior of the coefficients of many sextics, learned from all of them."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.faces.kinds import SEXTIC_BASIS, Kind, prior_precision
from touchatlas.atlas.faces.piece import Piece

# Order of the height z(x, y) that each coefficient makes.
_HEIGHTS = SEXTIC_BASIS.exponents @ np.array([1, 1, 2])
# Orders whose coefficients have a common size. Doubled, slopes would count, too: they depend on the
# frame.
_LEARNED = 2, 3, 4, 5, 6
# Rounds of expectation and maximisation. Doubled, nothing changes: sizes are within a hundredth.
_ROUNDS = 30


def with_common_prior(pieces: list[Piece]) -> list[Piece]:
    """The sextics of one face, as their samples and their common smoothness show them.

    A derivative of order o is as large on one sextic as on another, so that the coefficient of a
    sextic of scale r has a standard deviation proportional to r^(o-1). The factors make all
    samples most likely: expectation maximisation (A. P. Dempster, N. M. Laird, D. B. Rubin, JRSS B
    1977). Where samples leave a coefficient open it is as small as it is elsewhere.
    """
    before = prior_precision(Kind.SEXTIC)
    scales = np.array([piece.scale for piece in pieces])
    information = np.linalg.inv([piece.covariance for piece in pieces])
    means = np.array([piece.coefficients for piece in pieces])
    right = np.einsum("kij,kj->ki", information, means)
    samples = information - np.diag(before)
    precision = np.tile(before, (len(pieces), 1))
    covariances: np.ndarray = np.linalg.inv(information)
    for _ in range(_ROUNDS):
        variances = np.diagonal(covariances, axis1=1, axis2=2)
        for order in _LEARNED:
            own = order == _HEIGHTS
            unit = (scales / np.median(scales))[:, None] ** (2 * order - 2)
            size = float(((means[:, own] ** 2 + variances[:, own]) / unit).mean())
            precision[:, own] = 1.0 / (size * unit)
        covariances = np.linalg.inv(samples + precision[:, :, None] * np.eye(len(before)))
        means = np.einsum("kij,kj->ki", covariances, right)
    return [
        replace(piece, coefficients=mean, covariance=covariance)
        for piece, mean, covariance in zip(pieces, means, covariances, strict=True)
    ]
