"""What a piece may be wrong by at its rim although it explains its samples."""

import numpy as np

from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece

# Excess of chi-square that is not seen, in standard deviations. Doubled, blunt edges and slight
# rims are taken for errors of the pieces.
_UNSEEN = 4.0
# Slope and curvature at the end of the half-length r of the first Legendre polynomial that a kind
# leaves out, over its root mean square: P'(1) = n (n + 1) / 2 and P''(1) = (n - 1) n (n + 1)
# (n + 2) / 8, over 1 / sqrt(2 n + 1). A plane leaves out n = 2, a quartic n = 5, others n = 3.
_LEFT_OUT = {Kind.PLANE: 2, Kind.QUARTIC: 5}
_CUBIC = 3
# Error at a corner of a piece over that at the end of a line, no unit: the errors of both
# directions add. Doubled, slight rims are taken for errors of the pieces.
_CORNER = 2.0


def unseen_misfit(evidence: Evidence, piece: Piece, members) -> float:
    """Root mean square of the largest lack of fit that a piece's samples do not show, length."""
    distance = piece.at(evidence.samples.points[members])[0]
    distance = np.clip(distance, -3.0 * evidence.samples.std, 3.0 * evidence.samples.std)
    square = float((distance * distance).mean())
    return float(np.sqrt(square * min(1.0, _UNSEEN * np.sqrt(2.0 / len(members)))))


def rim_errors(kind: Kind, misfit: float, half_length: float) -> tuple[float, float]:
    """Largest error of the slope, rad, and of the curvature, 1/length, at the rim of a piece with a
    lack of fit.

    >>> slope, curvature = rim_errors(Kind.PLANE, 0.01, 10.0)
    >>> round(slope, 4), round(curvature, 5)
    (0.0134, 0.00134)
    """
    n = _LEFT_OUT.get(kind, _CUBIC)
    norm = _CORNER * misfit * np.sqrt(2 * n + 1)
    slope = norm * n * (n + 1) / 2 / half_length
    return float(slope), float(norm * (n - 1) * n * (n + 1) * (n + 2) / 8 / half_length**2)
