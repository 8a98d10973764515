"""Labels beside smooth rims: by the side of the rim, since distances cannot tell there.

A fillet of radius r is within the noise σ of its plane up to √(2 r σ) beside the rim; the rim
itself is known better than that by all samples of both together.
"""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import rim_distances
from touchatlas.atlas.labels.labels import Labels

# Farthest from a rim that a label is changed, in steps. Doubled, nothing changes: there distances
# tell labels apart.
_BESIDE = 2.0
# Largest nats by which a change may make a sample's misfit worse. Doubled, samples off both pieces
# change as well.
_WORSE = 2.0
# Samples of either piece that say on which side it lies. Doubled, narrow faces have wrong sides.
_NEAREST = 6


def move_to_rims(labels: Labels, boundaries: list[Boundary]) -> int:
    """Give samples beside smooth rims the label of their side; returns how many changed."""
    changed = 0
    for boundary in boundaries:
        if boundary.kind is EdgeKind.SMOOTH_RIM:
            changed += _move(labels, boundary)
    return changed


def _move(labels: Labels, boundary: Boundary) -> int:
    """The same at one rim."""
    evidence, pair = labels.evidence, (boundary.first, boundary.second)
    points = evidence.samples.points
    members = np.flatnonzero((labels.of == pair[0]) | (labels.of == pair[1]))
    reach = _BESIDE * float(np.median(evidence.samples.steps))
    away, _ = cKDTree(boundary.curve.points).query(points[members], distance_upper_bound=reach)
    near = members[np.isfinite(away)]
    if not len(near):
        return 0
    pieces = labels.pieces[pair[0]], labels.pieces[pair[1]]
    first = labels.of[near] == pair[0]
    toward = _mean_near(points, members, labels.of[members] == pair[0], near)
    toward -= _mean_near(points, members, labels.of[members] == pair[1], near)
    across = rim_distances(*pieces, points[near], toward)
    costs = [evidence.misfit(evidence.compare(piece, near)[0]) for piece in pieces]
    to_first = across > 0.0
    now, then = np.where(first, *costs), np.where(to_first, *costs)
    moves = (to_first != first) & (np.abs(across) < reach) & (then - now < _WORSE)
    labels.of[near[moves]] = np.where(to_first[moves], *pair)
    return int(moves.sum())


def _mean_near(points, members, chosen, near) -> np.ndarray:
    """(m, 3) mean of the chosen members that are nearest to samples near (m,)."""
    some = members[chosen]
    _, index = cKDTree(points[some]).query(points[near], k=min(_NEAREST, len(some)))
    mean: np.ndarray = points[some[index.reshape(len(near), -1)]].mean(axis=1)
    return mean
