"""The outer side of curves and points: from what tells it, and from one to the next."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial import cKDTree

from touchatlas.atlas.records.options import Levels

# Nearest points that are compared.
_NEAREST = 12
_TINY = 1e-9


def outward_signs(points, normals, groups, votes, levels: Levels, outside=None) -> np.ndarray:
    """(g,) 1 where the normals of a group of points face outward, -1 where they face inward, and 0
    where nothing tells.

    Groups that are known tell their neighbours, those first whose normals agree best (Hoppe and
    others, Surface reconstruction from unorganized points, 1992), and so does the surest of those
    that hang together where none is known. Without any, the one point ``outside`` tells, or a
    closed surface does: it faces away from what it encloses.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
    groups : (n,) int
        From 0 on: the points of a curve, or single points; normals of a group face alike.
    votes : (g,) float
        Mean cosine, from -1 to 1, of normals of each group and what tells their side; 0 where
        nothing does.
    levels : Levels
        A group is known where the cosine is that of normals that face the same side: at the limb
        of what was seen normals err by more than what is left of a right angle.
    outside : (3,) float, length, world, optional
    """
    count = len(votes)
    pairs, cosine = _neighbours(points, normals, groups, count)
    weight = 1.0 - np.abs(cosine) + _TINY
    known = np.flatnonzero(votes)
    rows = np.concatenate([pairs[:, 0], known])
    columns = np.concatenate([pairs[:, 1], np.full(len(known), count)])
    sure = np.abs(votes[known])
    # Any neighbour comes before a vote of less.
    data = np.concatenate([weight, np.where(sure >= levels.facing, 0.1 * _TINY, 3.0 - sure)])
    tree = minimum_spanning_tree(coo_array((data, (rows, columns)), (count + 1, count + 1)).tocsr())
    table = {(int(a), int(b)): np.sign(c) for (a, b), c in zip(pairs, cosine, strict=True)}
    table |= {(int(k), count): np.sign(votes[k]) for k in known}
    signs = np.zeros(count + 1)
    signs[count] = 1.0
    _spread(tree, count, signs, table)
    for group in range(count):
        if not signs[group]:
            signs[group] = 1.0
            part = _spread(tree, group, signs, table)
            own = np.isin(groups, part)
            facing = normals[own] * signs[groups[own]][:, None]
            signs[part] *= _side(points[own], facing, levels.closed, outside)
            if not signs[part].any():
                # The part is not known; it is not looked at again.
                signs[part] = np.nan
    return np.nan_to_num(signs[:count])


def _spread(tree, start: int, signs, table) -> np.ndarray:
    """Set the signs of all that hang together with a start in a tree; returns their numbers, with
    the start."""
    order, before = breadth_first_order(tree, start, directed=False)
    for one in order[1:].tolist():
        other = int(before[one])
        signs[one] = signs[other] * table[min(one, other), max(one, other)]
    return np.asarray(order)


def _neighbours(points, normals, groups, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (p, 2) of groups that have points near each other, the lower first, and the mean
    cosines (p,) of the normals there."""
    tree, left, k = cKDTree(points), np.arange(len(points)), _NEAREST
    found = []
    while len(left) and count > 1:
        near = tree.query(points[left], k=min(k, tree.n))[1].reshape(len(left), -1)
        other = groups[near] != groups[left][:, None]
        rows = np.flatnonzero(other.any(axis=1))
        i, j = np.nonzero(other[rows])
        found.append(np.stack([left[rows][i], near[rows][i, j]]))
        # Of the points of long curves one in so many finds others far away.
        left, k = np.setdiff1d(left, left[rows])[:: 2 if k > 4 * _NEAREST else 1], 2 * k
        if k > 2 * tree.n:
            break
    if not found:
        return np.zeros((0, 2), int), np.zeros(0)
    i, j = np.concatenate(found, axis=1)
    both = np.sort(groups[np.stack([i, j], axis=1)], axis=1)
    cosine = np.einsum("ij,ij->i", normals[i], normals[j])
    keys, of = np.unique(both[:, 0] * count + both[:, 1], return_inverse=True)
    mean = np.bincount(of, cosine) / np.bincount(of)
    apart = mean != 0.0
    return np.stack([keys // count, keys % count], axis=1)[apart], mean[apart]


def _side(points, normals, closed: float, outside) -> float:
    """1 where normals (n, 3) of points (n, 3) that hang together face outward, -1 where they face
    inward, 0 where nothing tells."""
    if outside is not None:
        nearest = int(((points - outside) ** 2).sum(axis=1).argmin())
        return float(np.sign((outside - points[nearest]) @ normals[nearest]))
    if len(points) < 2 * _NEAREST:
        return 0.0
    away = cKDTree(points).query(points, k=_NEAREST)[0][:, -1]
    vectors = normals * (away**2)[:, None]
    if np.linalg.norm(vectors.sum(axis=0)) > closed * (away**2).sum():
        return 0.0
    # The volume that a closed surface encloses: a third of the sum of normals times places.
    return float(np.sign(((points - points.mean(axis=0)) * vectors).sum()))


def is_closed(curve) -> bool:
    """Whether a curve (m, 3) ends where it begins, within three of its steps."""
    step = np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1))
    return bool(np.linalg.norm(curve[0] - curve[-1]) <= 3.0 * np.median(step))


def closed_curve_signs(curves, planes, normals) -> np.ndarray:
    """(c,) 1 where the normals of a closed plane curve face away from what it encloses, or, within
    another one in its plane, toward it; -1 where they face the other way.

    Parameters
    ----------
    curves : list of (m, 3) float, length, world
    planes : (c, 3) float, unit, world
    normals : list of (m, 3) float, unit, world
        In the planes.
    """
    out = np.zeros(len(curves))
    for k, (curve, plane, own) in enumerate(zip(curves, planes, normals, strict=True)):
        step = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
        # Stokes: the sum of normals times places is twice the area for those that face away.
        length = np.sqrt((step * step).sum(axis=1))[:, None]
        faces = np.sign(((curve - curve.mean(axis=0)) * own * length).sum())
        size = float(np.ptp(curve, axis=0).max())
        around = 0
        for j, other in enumerate(curves):
            offset = (other - curve.mean(axis=0)) @ plane
            if j != k and np.abs(offset).max() < 1e-2 * size:
                around += _encloses(other, plane, curve[0])
        out[k] = -faces if around % 2 else faces
    return out


def _encloses(curve, plane, point) -> bool:
    """Whether a closed curve (m, 3) in a plane with a unit normal (3,) winds about a point (3,)."""
    offset = curve - point
    after = np.roll(offset, -1, axis=0)
    sine = np.cross(offset, after) @ plane
    turn = np.arctan2(sine, (offset * after).sum(axis=1)).sum()
    return bool(abs(turn) > np.pi)
