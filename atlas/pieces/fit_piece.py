"""Fit a piece of a kind to samples."""

from collections.abc import Callable

from touchatlas.atlas.pieces.about_axis import fit_cone, fit_torus
from touchatlas.atlas.pieces.fit_cylinder import fit_cylinder
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece

# Fits of points, normals and deviations; that of any other kind is linear.
_FITS: dict[Kind, Callable[..., Piece | None]] = {
    Kind.CYLINDER: fit_cylinder,
    Kind.CONE: fit_cone,
    Kind.TORUS: fit_torus,
}


def fit_piece(kind: Kind, points, normals, std) -> Piece | None:
    """The piece of a kind that fits samples best, or None where there is none.

    Parameters
    ----------
    kind : Kind
    points : (n, 3) float, length, world
        As many as the kind has parameters, or more.
    normals : (n, 3) float, unit, world
        Outward, for the frame alone.
    std : float or (n,) float, length
        Standard deviation of a sample's distance, or that of each.

    Notes
    -----
    Orthogonal distances, linearised at the feet of the fit before. At the samples themselves F
    would be made small by a small gradient, where many polynomials vanish nearly.

    Examples
    --------
    >>> import numpy as np
    >>> direction = np.random.default_rng(0).normal(size=(200, 3))
    >>> direction /= np.linalg.norm(direction, axis=1)[:, None]
    >>> ball = fit_piece(Kind.SPHERE, 33.0 * direction, direction, 0.02)
    >>> float(abs(ball.at(60.0 * direction[:3])[0] - 27.0).max().round(3))
    0.0
    """
    if kind in _FITS:
        return _FITS[kind](points, normals, std)
    return linear_fit(kind, points, *frame_of(points, normals), std)
