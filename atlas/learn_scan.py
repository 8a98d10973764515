"""Learn a scan: its curves and points are oriented and entered as samples."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.learn import (
    check_noise,
    check_tip,
    check_unit_of_length,
    innovations,
    settle_scale,
    settle_tip,
)
from touchatlas.atlas.records.scan import Scan
from touchatlas.atlas.records.touch import AtlasChange
from touchatlas.atlas.samples.neighbourhoods import plane_directions, thinned
from touchatlas.atlas.samples.sides import closed_curve_signs, is_closed, outward_signs
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.normal_error import MOST_TILT
from touchatlas.patch.geometry.section import LEAST_POINTS

# Most samples that a cloud enters as, and points of curves: more take longer, and change little.
_MOST = 2000
_MOST_OF_CURVES = 6000


@dataclass(frozen=True, eq=False)
class _Strand:
    """Samples of one curve, or one sample of none.

    Parameters
    ----------
    points, normals, across : (m, 3) float, length; unit; unit or zero, world
        Normals face alike along a curve.
    noise : (m,) float, length
    places : (m,) int
        The points of the scan that they are, or are next to.
    closed : bool
    plane : (3,) float, unit, world, or None
        Of a plane curve.
    """

    points: np.ndarray
    normals: np.ndarray
    across: np.ndarray
    noise: np.ndarray
    places: np.ndarray
    closed: bool = False
    plane: np.ndarray | None = None


def learn_scan(state: AtlasState, scan: Scan) -> AtlasChange:
    """Enter the curves and points of a scan, or say why they are refused: nothing tells on which
    side of them the outside is, or they were learned before.

    Raises
    ------
    ValueError
        When the scan is out of all proportion to what was measured so far, of another tip, or
        without any error.
    """
    check_tip(state, "the scan", scan.tip_radius)
    check_noise(state, "the scan", scan.noise_std)
    stds, toward = np.hypot(scan.noise_std, state.bias), scan.toward
    outward = toward if scan.normals is None else scan.normals
    check_unit_of_length(state, "the scan", scan.points, stds, outward)
    # A noisy scan says little of the fits to come: they are to the tolerance.
    settle_scale(state, scan.noise_std, state.tolerance)
    strands = _strands(scan)
    points = np.concatenate([strand.points for strand in strands])
    if len(state.pool) and not cKDTree(state.pool.points).query(points)[0].any():
        return AtlasChange(
            refused="all points were learned before; give each once, because a repeated point "
            "holds no new measurement"
        )
    signs = _signs(state, scan, strands)
    if not signs.all():
        return AtlasChange(refused=_which_side(strands, signs))
    counts = [len(strand.points) for strand in strands]
    numbers = np.repeat(np.arange(len(strands)), counts)
    normals = np.concatenate([strand.normals for strand in strands]) * signs[numbers][:, None]
    across = np.concatenate([strand.across for strand in strands])
    noise = np.concatenate([strand.noise for strand in strands])
    news = innovations(state, points, noise)
    settle_tip(state, scan.tip_radius, scan.systematic_std)
    state.pool.add(points, normals, across, False, noise, numbers)
    return AtlasChange(innovations=news)


def _strands(scan: Scan) -> list[_Strand]:
    """The curves of a scan, then its other points."""
    numbers = np.full(len(scan), -1) if scan.curves is None else scan.curves
    names, counts = np.unique(numbers[numbers >= 0], return_counts=True)
    long = names[counts >= LEAST_POINTS]
    stride = -(-int(np.isin(numbers, long).sum()) // _MOST_OF_CURVES) if len(long) else 1
    tree = cKDTree(scan.points)
    found = []
    for name in long.tolist():
        own = np.flatnonzero(numbers == name)
        step = (np.diff(scan.points[own], axis=0) ** 2).sum(axis=1)
        # A point that repeats the one before is no new measurement.
        own = own[np.append(True, step > 0.0)]
        if len(own) >= LEAST_POINTS:
            found.append(_curve(scan, own, tree, max(1, min(stride, len(own) // LEAST_POINTS))))
    loose = np.flatnonzero(~np.isin(numbers, long))
    return found + _loose(scan, loose)


def _curve(scan: Scan, own, tree: cKDTree, stride: int) -> _Strand:
    """One curve of a scan, of the points ``own`` (m,): its normals lie in its plane where it has
    one, and are those of the surface about it where they are known."""
    points, noise = scan.points[own], scan.noise_std[own]
    size, vectors = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[1:]
    size, off = size / np.sqrt(len(own)), 3.0 * float(np.median(noise))
    flat = size[2] <= max(off, 0.01 * size[1])
    is_plane = bool(flat and size[1] > max(off, 0.01 * size[0]))
    before, after = np.maximum(np.arange(len(own)) - 2, 0), np.arange(len(own)) + 2
    after = np.minimum(after, len(own) - 1)
    tangents = _unit(points[after] - points[before])
    if scan.normals is not None:
        surface, sure = scan.normals[own], np.ones(len(own), bool)
    else:
        surface, sure = plane_directions(tree, points, noise)
    if is_plane:
        across = np.tile(vectors[2], (len(own), 1))
        normals = _unit(cross(across, tangents))
    else:
        normals = _facing_alike(_unit(surface - _dot(surface, tangents) * tangents))
        across = _unit(cross(normals, tangents))
    # A curve shows a part of the normal; what lies about it may show all of it.
    leans = _dot(surface, normals)[:, 0]
    better = sure & (np.abs(leans) > 0.5)
    normals = np.where(better[:, None], np.sign(leans)[:, None] * surface, normals)
    some = np.arange(0, len(own), stride)
    plane = vectors[2] if is_plane else None
    columns = points[some], normals[some], across[some], noise[some], own[some]
    return _Strand(*columns, is_closed(points), plane)


def _facing_alike(normals) -> np.ndarray:
    """Normals (m, 3) along a curve, turned so that each faces as the one before it does."""
    turn = np.sign(np.einsum("ij,ij->i", normals[1:], normals[:-1]))
    turn[turn == 0.0] = 1.0
    return np.asarray(normals * np.concatenate([[1.0], np.cumprod(turn)])[:, None])


def _loose(scan: Scan, own) -> list[_Strand]:
    """The points of no curve, those of a dense cloud as fewer and surer samples."""
    if not len(own):
        return []
    found, index = thinned(scan.points[own], scan.noise_std[own], _MOST), own
    normals = found.normals
    if len(found.points) < len(own):
        index = own[cKDTree(scan.points[own]).query(found.points)[1]]
    elif scan.normals is not None:
        normals = scan.normals[own]
    zero = np.zeros((1, 3))
    return [
        _Strand(found.points[k : k + 1], normals[k : k + 1], zero, found.noise[[k]], index[[k]])
        for k in range(len(index))
    ]


def _signs(state: AtlasState, scan: Scan, strands: list[_Strand]) -> np.ndarray:
    """(s,) 1 where the normals of a strand face outward, -1 where they face inward, 0 where nothing
    tells."""
    points = np.concatenate([strand.points for strand in strands])
    normals = np.concatenate([strand.normals for strand in strands])
    index = np.concatenate([strand.places for strand in strands])
    groups = np.repeat(np.arange(len(strands)), [len(strand.points) for strand in strands])
    toward = scan.toward if scan.normals is None else scan.normals
    cosine = np.einsum("ij,ij->i", normals, toward[index])
    cosine[np.abs(cosine) < np.sin(MOST_TILT)] = 0.0
    tells = np.maximum(np.bincount(groups, cosine != 0.0, len(strands)), 1.0)
    votes = np.bincount(groups, cosine, len(strands)) / tells
    # One in four may be wrong, as by a bad normal.
    votes[np.abs(np.bincount(groups, np.sign(cosine), len(strands))) < 0.5 * tells] = 0.0
    closed = [k for k, one in enumerate(strands) if one.closed and one.plane is not None]
    if closed and not votes.any():
        own = [strands[k] for k in closed]
        planes = np.array([one.plane for one in own])
        columns = [one.points for one in own], planes, [one.normals for one in own]
        votes[closed] = closed_curve_signs(*columns)
    votes = np.where(votes == 0.0, _known_sides(state, points, normals, groups), votes)
    return outward_signs(points, normals, groups, votes, state.levels, scan.outside)


def _known_sides(state: AtlasState, points, normals, groups) -> np.ndarray:
    """(s,) what the known surface says of the side of groups of points (n, 3) with normals
    (n, 3)."""
    count = int(groups[-1]) + 1
    if state.body is None:
        return np.zeros(count)
    found, known = state.body.at(points)
    near = known & (np.abs(found.distance) <= 0.05 * state.body.extent)
    cosine = np.einsum("ij,ij->i", found.normal, normals)
    says = np.where(near & (np.abs(cosine) > state.levels.facing), np.sign(cosine), 0.0)
    return np.sign(np.bincount(groups, says, count))


def _which_side(strands: list[_Strand], signs) -> str:
    """The question that is left where nothing tells the outer side of some strands."""
    unknown = [strand for strand, sign in zip(strands, signs, strict=True) if not sign]
    at = np.array2string(unknown[0].points[0], precision=4, separator=", ")
    return (
        f"nothing tells on which side the outside is, as at {at}, for {len(unknown)} of "
        f"{len(strands)} curves and points; give normals, directions of approach, a viewpoint, or "
        "a point outside near the surface"
    )


def _dot(a, b) -> np.ndarray:
    """(n, 1) scalar products of vectors (n, 3)."""
    return np.asarray((a * b).sum(axis=1, keepdims=True))


def _unit(vectors) -> np.ndarray:
    """(n, 3) unit vectors along vectors (n, 3); any for one of length zero."""
    length = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    return np.where(length > 0.0, vectors / np.maximum(length, np.finfo(float).tiny), np.eye(3)[2])
