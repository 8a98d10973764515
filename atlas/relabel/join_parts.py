"""Parts of one lawful face between which no contour ran are joined."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import SIMPLE_LAWS
from touchatlas.atlas.relabel.moves import join_as_one
from touchatlas.patch.geometry.arrays import evenly


def join_parts(labels: Labels) -> None:
    """Join parts of one lawful face between which no contour ran and no other face stands, the
    largest first."""
    members = labels.all_members()
    order = np.argsort([-len(mine) for mine in members], kind="stable").tolist()
    parts = [label for label in order if labels.pieces[label].kind in SIMPLE_LAWS]
    near = _are_near(labels, members)
    while parts:
        own = parts.pop(0)
        others = (k for k in parts if near[own, k] and _join_part(labels, own, k, members))
        other = next(others, None)
        if other is not None:
            parts.remove(other)
            parts.insert(0, len(labels.pieces) - 1)
            members = labels.all_members()
            near = _are_near(labels, members)


def _reach(labels: Labels) -> float:
    """Distance of two parts of one face up to which they are joined, length: each is believed up to
    a share of the extent."""
    samples = labels.evidence.samples
    return 2.0 * samples.levels.believed * samples.extent


def _are_near(labels: Labels, members: list[np.ndarray]) -> np.ndarray:
    """(f, f) whether the boxes about the ``members`` of two labels are within reach of each other.
    Where they are not, no two samples are."""
    points = [labels.evidence.samples.points[mine] for mine in members]
    low = np.reshape([at.min(axis=0, initial=np.inf) for at in points], (-1, 3))
    high = np.reshape([at.max(axis=0, initial=-np.inf) for at in points], (-1, 3))
    gap = np.maximum(np.maximum(low[:, None] - high, low - high[:, None]), 0.0)
    return np.asarray(np.sqrt((gap * gap).sum(axis=2)) <= _reach(labels))


def _join_part(labels: Labels, a: int, b: int, members: list[np.ndarray]) -> bool:
    """Whether two labels, of the ``members`` of each, are parts of one face, which are joined
    then."""
    if labels.pieces[a].kind is not labels.pieces[b].kind:
        return False
    first, second, samples = members[a], members[b], labels.evidence.samples
    if not (len(first) and len(second) and _continues(labels, a, second)):
        return False
    reach, tree = _reach(labels), cKDTree(samples.points[first])
    away, near = tree.query(samples.points[second], distance_upper_bound=reach)
    at = int(away.argmin())
    if away[at] >= reach or _stands_between(labels, a, b, first[near[at]], second[at]):
        return False
    kinds = [kind for kind in SIMPLE_LAWS if kind <= labels.pieces[a].kind]
    return join_as_one(labels, first, second, kinds)


def _continues(labels: Labels, label: int, members) -> bool:
    """Whether the piece of a label may go on to samples (m,), as sure as it is there."""
    evidence, piece, some = labels.evidence, labels.pieces[label], evenly(members, 100)

    def goes_on() -> bool:
        distance, _, variance = piece.predicted(evidence.samples.points[some])
        std = evidence.samples.stds[some]
        square = (distance / std) ** 2 / (1.0 + variance / std**2)
        return bool(np.median(square) < evidence.sure**2)

    return bool(evidence.recall.get(goes_on, "goes on", piece, some))


def _stands_between(labels: Labels, a: int, b: int, first: int, second: int) -> bool:
    """Whether a sample between two others, no farther from the way than they are from each other,
    is of another face that crosses the way or faces as the first does, and lies off it."""
    samples, facing = labels.evidence.samples, labels.evidence.facing
    noise = labels.evidence.sure * samples.std
    way, offset = (
        samples.points[second] - samples.points[first],
        samples.points - samples.points[first],
    )
    length = float(np.sqrt(way @ way)) + float(np.finfo(float).tiny)
    along = offset @ way / length
    beside = (offset * offset).sum(axis=1) - along**2
    inside = (along > -noise) & (along < length + noise) & (beside < length**2)
    inside &= ~np.isin(labels.of, [NONE, a, b])
    own = labels.pieces[a]
    outward = own.at(samples.points[[first]])[1][0]
    for label in np.unique(labels.of[inside]).tolist():
        at = samples.points[inside & (labels.of == label)]
        if (np.abs(own.at(at)[0]) < noise).all():
            continue
        normals = labels.pieces[label].at(at)[1]
        if ((np.abs(normals @ way) > facing * length) | (normals @ outward > facing)).any():
            return True
    return False
