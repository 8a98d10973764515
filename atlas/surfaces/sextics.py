"""Sextics: many polynomial patches as arrays, evaluated at many points at once."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS, Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.polynomial import GRADIENT, derivative_coefficients, monomials

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Sextics:
    """Sextics as arrays.

    Parameters
    ----------
    origins : (p, 3) float, length, world
        Their middles.
    axes : (p, 3, 3) float, unit rows, world
        The third is the outward normal.
    radii : (p,) float, length
        Units of their scaled coordinates.
    coefficients : (p, t) float, no unit
    factors : (p, t, t) float, no unit
        Upper triangular U; U' U are the covariances of the coefficients.
    """

    origins: np.ndarray
    axes: np.ndarray
    radii: np.ndarray
    coefficients: np.ndarray
    factors: np.ndarray

    def __len__(self) -> int:
        return len(self.origins)

    def some(self, index) -> "Sextics":
        """Some of them (k,)."""
        own = self.origins[index], self.axes[index], self.radii[index], self.coefficients[index]
        return Sextics(*own, self.factors[index])

    def piece(self, number: int) -> Piece:
        """One of the sextics."""
        factor = self.factors[number].astype(float)
        frame = self.origins[number], self.axes[number], float(self.radii[number])
        return Piece(Kind.SEXTIC, *frame, self.coefficients[number], factor.T @ factor)

    def values(self, numbers, points) -> tuple[np.ndarray, np.ndarray]:
        """(m, 4) distances and unit normals of sextics ``numbers`` (m,) at points (m, 3), and the
        lengths (m,) by which the deviations of scaled heights there are multiplied.

        The distance is that of first order (Taubin 1991). Beyond its radius a sextic goes on as
        the plane that touches it in its middle.
        """
        out, stretch = np.empty((len(numbers), 4)), np.empty(len(numbers))
        for piece, places, filled in _rows_of(numbers):
            scaled, beyond, terms = self._inside(piece, points.take(places, axis=0))
            values = self._gradients.take(piece, axis=0) @ terms
            np.negative(values, out=values)
            values[:, 0] += scaled[:, 2]
            values[:, 3] += 1.0
            length, radius = _lengths(values[:, 1:]), self.radii[piece, None]
            units = radius
            if (beyond > 1.0).any():
                self._go_on(piece, scaled, beyond, values)
                length, units = _lengths(values[:, 1:]), radius * beyond**4
            np.maximum(length, _TINY, out=length)
            values /= length[:, None]
            values[:, 0] *= radius
            values[:, 1:] = self.axes[piece].transpose(0, 2, 1) @ values[:, 1:]
            own = np.flatnonzero(filled)
            target = places.ravel().take(own)
            out[target] = values.transpose(0, 2, 1).reshape(-1, 4).take(own, axis=0)
            stretch[target] = (units / length).ravel().take(own)
        return out, stretch

    @cached_property
    def _gradients(self) -> np.ndarray:
        """(p, 4, s) coefficients of the value and the gradient of each."""
        return derivative_coefficients(SEXTIC_BASIS, self.coefficients, list(GRADIENT))

    def variances(self, numbers, points) -> np.ndarray:
        """(m,) variances of the scaled heights of sextics ``numbers`` (m,) at points (m, 3):
        |U t|^2 with the monomials t."""
        out = np.empty(len(numbers))
        for piece, places, filled in _rows_of(numbers):
            terms = self._inside(piece, points.take(places, axis=0))[2][:, : SEXTIC_BASIS.size]
            white = self.factors.take(piece, axis=0) @ terms.astype(np.float32)
            out[places[filled]] = (white * white).sum(axis=1)[filled]
        return out

    def _inside(self, piece, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Scaled local coordinates (g, 3, n) of points in rows (g, n, 3); by how much they are
        beyond the scale (g, n), one or more; and monomials (g, s, n) where they are not, or at the
        scale."""
        offset = (points - self.origins[piece, None]).transpose(0, 2, 1)
        scaled = (self.axes[piece] / self.radii[piece, None, None]) @ offset
        beyond = np.maximum(_lengths(scaled), 1.0)
        x, y, z = (scaled[:, axis] / beyond for axis in range(3))
        return scaled, beyond, monomials(SEXTIC_BASIS, x, y, z).transpose(1, 0, 2)

    def _go_on(self, piece, scaled, beyond, values) -> None:
        """Put value and gradient of the plane into ``values`` (g, 4, n) beyond the scale."""
        row, place = np.nonzero(beyond > 1.0)
        level, by_x, by_y = self.coefficients[piece[row], :3].T
        upward = np.stack([-by_x, -by_y, np.ones(len(row))], axis=1)
        away = scaled[row, :, place]
        away[:, 2] -= level
        values[row, 0, place] = (away * upward).sum(axis=1)
        values[row, 1:, place] = upward


def joined(parts: list[Sextics]) -> Sextics:
    """All sextics of parts as one."""
    names = [field.name for field in fields(Sextics)]
    return Sextics(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _lengths(vectors) -> np.ndarray:
    """(g, n) lengths of vectors (g, 3, n)."""
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _rows_of(numbers) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Rows of up to 32 places in ``numbers`` that have the same number: the number (g,) of each,
    the places (g, n), and which of them are filled (g, n); the others repeat the first. So many
    rows come at once that their monomials fit into the cache of a processor."""
    # Of small integers the order is found by their digits, in a tenth of the time.
    small = np.min_scalar_type(numbers.max(initial=0))
    order = np.argsort(numbers.astype(small), kind="stable")
    counts = np.bincount(numbers)
    own = max(int(np.count_nonzero(counts)), 1)
    width = min(1 << (-(-max(len(numbers), 1) // own) - 1).bit_length(), 32)
    rows = -(-counts // width)
    of_row = np.repeat(np.arange(len(counts)), rows)
    within = np.arange(len(of_row)) - np.repeat(np.cumsum(rows) - rows, rows)
    first = (np.cumsum(counts) - counts)[of_row] + within * width
    size = np.minimum(counts[of_row] - within * width, width)
    step = 1536 // width
    for start in range(0, len(of_row), step):
        some = slice(start, start + step)
        filled = np.arange(width) < size[some, None]
        yield of_row[some], order[first[some, None] + filled * np.arange(width)], filled
