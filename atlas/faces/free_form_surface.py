"""FreeFormSurface: overlapping quartics of a free-form face, averaged by a partition of unity."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.kinds import terms_at, value_and_gradient
from touchatlas.atlas.faces.piece import Piece

# Quartics that are averaged at a point at most: about as many as reach it. Doubled, nothing
# changes.
_AVERAGED = 12


@dataclass(frozen=True, eq=False)
class FreeFormSurface:
    """Overlapping quartics, averaged at each point with weights that fall to zero with the distance
    from their middles: the partition of unity of Y. Ohtake, A. Belyaev, M. Alexa, G. Turk, H.-P.
    Seidel, "Multi-level partition of unity implicits", SIGGRAPH 2003.

    Parameters
    ----------
    pieces : tuple of Piece
        Quartics, each fitted within its scale about its origin, the middle.
    """

    pieces: tuple[Piece, ...]

    def values(self, points) -> np.ndarray:
        """(n, 5) distance, normal and variance at points (n, 3). Beyond its scale a quartic
        goes on as the plane that touches it in its middle; its deviation grows as it does."""
        count, out = min(_AVERAGED, len(self.pieces)), np.empty((len(points), 5))
        away, near = (np.reshape(x, (-1, count)) for x in self._tree.query(points, k=count))
        ratio = away / self._scales[near]
        weight = np.maximum(1.0 - ratio, 0.0) ** 4 * (1.0 + 4.0 * ratio)
        rows, best = np.arange(len(points)), ratio.argmin(axis=1)
        weight[rows, best] += np.finfo(float).tiny
        which, slot = np.nonzero(weight)
        share = weight[which, slot]
        found = self._of_pieces(near[which, slot], points[which], slot == best[which])
        for column in range(4):
            out[:, column] = np.bincount(which, share * found[:, column], len(points))
        out[:, 0] /= np.bincount(which, share, len(points))
        length = np.sqrt((out[:, 1:4] ** 2).sum(axis=1))
        out[:, 1:4] /= np.maximum(length, np.finfo(float).tiny)[:, None]
        out[:, 4] = found[slot == best[which], 4]
        return out

    def shape_operators(self, points) -> np.ndarray:
        """(n, 3, 3) shape operators, 1/length, of the quartics whose middles are nearest."""
        out, nearest = np.empty((len(points), 3, 3)), self._tree.query(points)[1]
        for k in np.unique(nearest).tolist():
            mine = nearest == k
            out[mine] = self.pieces[k].shape_operators(points[mine])
        return out

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree([piece.origin for piece in self.pieces])

    @cached_property
    def _scales(self) -> np.ndarray:
        return np.array([piece.scale for piece in self.pieces])

    def _of_pieces(self, rows, points, is_best) -> np.ndarray:
        """(m, 5) distance, normal and variance of quartics ``rows`` (m,) at points (m, 3); the
        variance where it ``is_best`` (m,) alone, which takes longest."""
        out = np.zeros((len(rows), 5))
        order = np.argsort(rows, kind="stable")
        bounds = np.searchsorted(rows[order], np.arange(len(self.pieces) + 1))
        for number in np.flatnonzero(np.diff(bounds)).tolist():
            piece, mine = self.pieces[number], order[bounds[number] : bounds[number + 1]]
            best = is_best[mine]
            scaled = piece.scaled(points[mine])
            beyond = np.maximum(np.sqrt((scaled * scaled).sum(axis=1)), 1.0)
            inside = scaled / beyond[:, None]
            terms = terms_at(piece.kind, inside)
            value, gradient = value_and_gradient(piece.kind, piece.coefficients, inside, terms)
            far = beyond > 1.0
            level, gradient[far] = piece.coefficients[0], _upward(piece)
            value[far] = ((scaled[far] - [0.0, 0.0, level]) * gradient[far]).sum(axis=1)
            length = np.sqrt((gradient * gradient).sum(axis=1))
            length = np.maximum(length, np.finfo(float).tiny)
            out[mine, 0] = value * piece.scale / length
            out[mine, 1:4] = (gradient / length[:, None]) @ piece.axes
            own = terms[: piece.kind.terms, best]
            variance = ((piece.covariance @ own) * own).sum(axis=0)
            spread = piece.scale * beyond[best] ** 4 / length[best]
            out[mine[best], 4] = np.maximum(variance, 0.0) * spread**2
        return out


def _upward(piece: Piece) -> np.ndarray:
    """(3,) gradient of F in the middle of a quartic."""
    _, by_x, by_y = piece.coefficients[:3]
    return np.array([-by_x, -by_y, 1.0])
