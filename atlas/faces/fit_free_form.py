"""Fit a free-form face: overlapping quartics, each as large as it follows the samples about it."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.fit_piece import linear_fit
from touchatlas.atlas.faces.free_form_surface import FreeFormSurface
from touchatlas.atlas.faces.grow import evenly
from touchatlas.atlas.faces.kinds import Kind
from touchatlas.atlas.faces.piece import Piece
from touchatlas.atlas.faces.quartic_prior import with_common_prior
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal

# Factor by which the radius of a quartic shrinks until it follows its samples. Nearer to 1, radii
# are a little larger, and more fits are tried.
_SHRINK = 0.7
# Distance from the middle of a quartic within which no other one has its middle, in radii. Doubled,
# a quarter of the quartics is left, and they meet where they are least sure.
_APART = 0.5
# Least number of samples of a quartic with a smaller radius than the largest: twice its parameters.
# Doubled, narrow bends are rounded off.
_LEAST = 42
# A quartic does not follow its samples where the mean square of their distances, in variances of a
# sample, exceeds one by so much. Doubled, quartics are larger and err more.
_EXCESS = 0.3
# Least cosine of the normals of a sample and of the middle of a quartic: 78 degrees. Doubled,
# quartics end before sharp bends.
_FACING = 0.2
# Deviations up to which a sample without a label is on the surface. Doubled, samples of other
# features are taken for those of the face.
_SURE = 3.0
# Deviation of the surface, in deviations of a sample, from which a sample without a label tells
# nothing: it may be of any face. Doubled, samples of other faces bend the surface beyond its edge.
_VAGUE = 5.0
# Least square of the sine of a tangent and the normal. Doubled, nothing changes.
_LEAST_TANGENT = 1e-6
# Most samples of a fit. Doubled, it takes longer.
_FITTED = 400


def fit_free_form(points, normals, std: float, radius: float) -> FreeFormSurface:
    """The surface of a face from its samples.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward.
    std : float, length
        Standard deviation of a sample's distance.
    radius : float, length
        Largest radius of a quartic.
    """
    tree, left = cKDTree(points), np.ones(len(points), bool)
    pieces = []
    for site in range(len(points)):
        if left[site]:
            pieces.append(_largest(tree, points, normals, site, std, radius))
            left[tree.query_ball_point(points[site], _APART * pieces[-1].scale)] = False
    return FreeFormSurface(tuple(with_common_prior(pieces)))


def _largest(tree, points, normals, site: int, std: float, radius: float) -> Piece:
    """The quartic about a sample with the largest radius with which it follows the samples near;
    where none does the smallest one, with a deviation as large as its misfit."""
    piece = None
    while True:
        near = np.sort(tree.query_ball_point(points[site], radius))
        near = near[normals[near] @ normals[site] > _FACING]
        if piece is not None and len(near) < _LEAST:
            return piece
        some = points[evenly(near, _FITTED)]
        axes = _axes(some, points[site], normals[near].mean(axis=0))
        piece = linear_fit(Kind.QUARTIC, some, points[site], axes, radius, std)
        distance, _, variance = piece.predicted(some)
        excess = float((distance**2).mean() / std**2) - 1.0
        if excess <= _EXCESS and np.isfinite(variance).all():
            return piece
        piece = replace(piece, covariance=(1.0 + max(excess, 0.0)) * piece.covariance)
        radius *= _SHRINK


def _axes(points, origin, normal) -> np.ndarray:
    """Axes with a normal, the first towards the farthest of the points (n, 3): they turn as these
    do."""
    offset = points - origin
    square = (offset * offset).sum(axis=1)
    normal = normal / np.sqrt(normal @ normal)
    tangent = offset[square.argmax()]
    across = tangent - (tangent @ normal) * normal
    if not across @ across > _LEAST_TANGENT * square.max():
        tangent = any_tangent(normal)
    return axes_from_normal(normal, tangent)


def are_on(surface: FreeFormSurface, points, std: float) -> np.ndarray:
    """(n,) whether samples at points (n, 3) lie on a surface within the deviations of both, where
    the surface is known well enough to tell."""
    values = surface.values(points)
    on = values[:, 0] ** 2 <= _SURE**2 * (values[:, 4] + std**2)
    return np.asarray(on & (values[:, 4] <= _VAGUE**2 * std**2))
