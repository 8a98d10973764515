"""Fit a free-form face: overlapping sextics, as large as they follow the samples, and kriging."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.fit_piece import linear_fit
from touchatlas.atlas.faces.free_form_surface import FACING, FreeFormSurface
from touchatlas.atlas.faces.grow import evenly
from touchatlas.atlas.faces.kinds import Kind
from touchatlas.atlas.faces.piece import Piece
from touchatlas.atlas.faces.residual_kriging import amplitudes_of, krige
from touchatlas.atlas.faces.sextic_prior import with_common_prior
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal

# Factor by which the radius of the sextics shrinks until they follow the samples. Nearer to 1, radii
# are a little larger, and more are tried.
_SHRINK = 0.7
# Distance from the middle of a sextic within which no other one has its middle, in radii. Doubled,
# a quarter of the sextics is left, and they meet where they are least sure.
_APART = 0.5
# Least number of samples of a sextic, in the median, for a smaller radius: twice its parameters.
# Doubled, narrow bends are rounded off.
_LEAST = 98
# Sextics follow the samples where the residuals about half of them have an amplitude of no more than
# this, in deviations of a sample. At 0.7 to 2.5 scans are known about as well. Doubled, bends are
# left to kriging, which knows them less.
_FOLLOWS = 1.4
# Cosine of the normals of two samples below which both may be the middles of sextics however near
# they are: 60 degrees. Doubled, tubes have twice as many.
_TURNED = 0.5
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
    """The surface of a face from its samples: sextics of the largest radius with which they follow
    the samples, and kriging of what they leave out.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward.
    std : float, length
        Standard deviation of a sample's distance.
    radius : float, length
        Largest radius of a sextic.
    """
    tree = cKDTree(points)
    while True:
        found = _of_radius(tree, points, normals, std, radius)
        values = found.values(points)
        rest, side = values[:, 0], values[:, 1:4]
        amplitudes = amplitudes_of(tree, side, rest, std)
        follows = np.median(amplitudes) <= _FOLLOWS * std
        if follows or _median_count(found, tree) < _LEAST:
            break
        radius *= _SHRINK
    return replace(found, normals=side, rest=krige(points, side, rest, radius, std))


def _median_count(surface: FreeFormSurface, tree) -> float:
    """Median number of the samples that a sextic of the next radius would follow."""
    counts = [
        tree.query_ball_point(piece.origin, _SHRINK * piece.scale, return_length=True)
        for piece in surface.pieces
    ]
    return float(np.median(counts))


def _of_radius(tree, points, normals, std: float, radius: float) -> FreeFormSurface:
    """The sextics of one radius."""
    left, pieces = np.ones(len(points), bool), []
    for site in range(len(points)):
        if left[site]:
            near = np.sort(tree.query_ball_point(points[site], radius))
            pieces.append(_sextic(points, normals, site, near, std, radius))
            near = near[((points[near] - points[site]) ** 2).sum(axis=1) <= (_APART * radius) ** 2]
            left[near[normals[near] @ normals[site] > _TURNED]] = False
    return FreeFormSurface(tuple(with_common_prior(pieces)), points, normals)


def _sextic(points, normals, site: int, near, std: float, radius: float) -> Piece:
    """The sextic about a sample, of those ``near`` (m,) that face as it does."""
    near = near[normals[near] @ normals[site] > FACING]
    some = points[evenly(near, _FITTED)]
    axes = _axes(some, points[site], normals[near].mean(axis=0))
    return linear_fit(Kind.SEXTIC, some, points[site], axes, radius, std)


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
