"""Normals of points from their neighbours, and few surer samples of a dense cloud."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.patch.geometry.arrays import evenly
from touchatlas.patch.geometry.normal_error import MOST_TILT
from touchatlas.patch.geometry.section import MOST_TURN

# Neighbours from which a plane is fitted: as few as show a surface, and at most.
_FEWEST, _MOST = 12, 192
# Least ratio of the variances along and across neighbours that show a plane, not a line: that of an
# arc that turns by an angle t either way is t^2 / 15.
_WIDE = MOST_TURN**2 / 15.0


class Local(NamedTuple):
    """Points with what their neighbours show.

    Parameters
    ----------
    points : (m, 3) float, length, world
    normals : (m, 3) float, unit, world
        Of either sign.
    noise : (m,) float, length
        Standard deviation of the distance of a point from the surface.
    """

    points: np.ndarray
    normals: np.ndarray
    noise: np.ndarray


def plane_directions(tree: cKDTree, points, noise) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (m, 3), of either sign, of planes through the neighbours of points (m, 3) of a
    tree, by principal components (Hoppe and others, Surface reconstruction from unorganized points,
    1992), and whether (m,) the neighbours show one.

    The neighbours are as few as lie in two directions, farther than the noise (m,), length.
    """
    out, sure = np.zeros((len(points), 3)), np.zeros(len(points), bool)
    left, count = np.arange(len(points)), _FEWEST
    while len(left):
        near = tree.query(points[left], k=min(count, tree.n))[1].reshape(len(left), -1)
        window = tree.data[near]
        offset = window - window.mean(axis=1, keepdims=True)
        values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offset, offset) / near.shape[1])
        out[left] = vectors[:, :, 0]
        wide = values[:, 1] > np.maximum(_WIDE * values[:, 2], (4.0 * noise[left]) ** 2)
        sure[left] = wide & (values[:, 0] < 0.3 * values[:, 1])
        left = left[~wide]
        if count >= min(_MOST, tree.n):
            break
        count *= 2
    return out, sure


def thinned(points, noise, most: int) -> Local:
    """At most so many samples of a cloud (n, 3) with noise (n,), length, and their normals.

    One sample stands for the points of a cube: the foot of their middle on a quadric through the
    neighbours. It is as sure as the points of the cube are together, and no surer. Where no quadric
    follows the neighbours, as at an edge, or its normal is unsure, as at the limb of what a camera
    saw, one of them is taken as it was measured.
    """
    tree = cKDTree(points)
    if len(points) <= most:
        return Local(points, plane_directions(tree, points, noise)[0], noise)
    cube = _cubes(points, most)
    count = np.bincount(cube)
    middles = np.stack([np.bincount(cube, x) for x in points.T], axis=1) / count[:, None]
    near = tree.query(middles, k=int(np.clip(3 * len(points) // len(count), _FEWEST, _MOST)))[1]
    own = np.sqrt((noise[near] ** 2).mean(axis=1))
    feet, normals, leverage, rms, slope = _quadrics(points[near], middles)
    std = own * np.sqrt(np.maximum(leverage, 1.0 / count))
    follows = rms <= own * np.sqrt(1.0 + 5.0 * np.sqrt(2.0 / near.shape[1]))
    follows &= own * slope <= MOST_TILT
    first = near[:, 0]
    alone = plane_directions(tree, points[first], noise[first])[0]
    return Local(
        np.where(follows[:, None], feet, points[first]),
        np.where(follows[:, None], normals, alone),
        np.where(follows, std, noise[first]),
    )


def noise_of_cloud(tree: cKDTree) -> float | None:
    """Noise of the points of a tree, length, by the median of the residuals about quadrics through
    their neighbours; None of too few points."""
    if tree.n < 2 * _FEWEST:
        return None
    some = evenly(np.arange(tree.n), 500)
    near = tree.query(tree.data[some], k=2 * _FEWEST)[1]
    return float(np.median(_quadrics(tree.data[near], tree.data[some])[3]))


def _cubes(points, most: int) -> np.ndarray:
    """(n,) numbers of the cubes of points, of which there are at most so many."""
    offset = points - points.min(axis=0)
    edge = float(np.linalg.norm(offset.max(axis=0))) / np.sqrt(most) * 0.25
    while True:
        rows = np.floor(offset / edge + [0.31, 0.43, 0.37]).astype(np.int64)
        of = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
        if of.max() < most:
            return np.asarray(of)
        edge *= 1.1


def _quadrics(windows, middles):
    """Feet (m, 3) of middles (m, 3) on quadrics through windows (m, k, 3), normals (m, 3) there,
    variances (m,) over that of a point, residuals (m,), length, and deviations (m,) of the normals,
    rad, over that of a point: heights over the plane of principal components, with all terms to the
    second order."""
    offset = windows - middles[:, None]
    spread = offset - offset.mean(axis=1, keepdims=True)
    axes = np.linalg.eigh(np.einsum("nki,nkj->nij", spread, spread))[1]
    x, y, z = np.moveaxis(np.einsum("nki,nij->nkj", offset, axes[:, :, ::-1]), 2, 0)
    scale = np.sqrt((x * x + y * y).mean(axis=1, keepdims=True)) + np.finfo(float).tiny
    x, y = x / scale, y / scale
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2)
    inverse = np.linalg.inv(terms.transpose(0, 2, 1) @ terms + 1e-9 * np.eye(6))
    solved = np.einsum("nij,nkj,nk->ni", inverse, terms, z)
    rest = z - np.einsum("nkj,nj->nk", terms, solved)
    rms = np.sqrt((rest * rest).sum(axis=1) / max(windows.shape[1] - 6, 1))
    upward = np.stack([*(-solved[:, 1:3] / scale).T, np.ones(len(z))], axis=1)
    upward /= np.linalg.norm(upward, axis=1)[:, None]
    world = np.einsum("nij,nj->ni", axes[:, :, ::-1], upward)
    # The height at the middle, as the distance along the normal there.
    feet = middles + (solved[:, 0] * upward[:, 2])[:, None] * world
    slope = np.sqrt(inverse[:, 1, 1] + inverse[:, 2, 2]) / scale[:, 0]
    return feet, world, inverse[:, 0, 0], rms, slope
