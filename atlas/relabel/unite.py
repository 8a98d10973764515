"""Unite: one piece for the parts of a plane, sphere or cylinder between which no contour ran.

Samples of the parts are not linked, so that merging does not try them.
"""

from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.merge import piece_of_least_kind

_LAWS = Kind.PLANE, Kind.SPHERE, Kind.CYLINDER
# Largest distance of two parts, over the extent of the samples. Doubled, the tops of two blocks of
# one height become one face, until what is between them is touched.
_APART = 0.25
# Largest median distance of the samples of a part from the other part's piece, over the extent, for
# them to be compared. Doubled, unlike parts are compared in vain.
_OFF = 0.05
# Sine of the angle between a face and the way from part to part, from which it stands in the way:
# 30 degrees. Doubled, low steps between two parts are passed over.
_IN_THE_WAY = 0.5
# Cosine of the angle between normals up to which a face between two parts is another side of the
# body: 60 degrees. Doubled, none stands in the way.
_ALIKE = 0.5
# How far beyond the ends of the way a face may stand in it, in standard deviations of a sample: the
# sides of a slot begin there. Doubled, nothing changes.
_NOISE = 4.0


def unite(labels: Labels) -> int:
    """Give parts of one lawful face one label, where the description becomes shorter and no other
    face stands between them; returns how many were united."""
    points = labels.evidence.samples.points
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    reach = _APART * extent
    members = labels.all_members()
    united = 0
    for a, b in _alike(labels, members):
        first, second = members[a], members[b]
        # One of them may have been united with a third part.
        if not (len(first) and len(second)):
            continue
        off = np.abs(labels.pieces[a].at(points[second])[0])
        if np.median(off) > _OFF * extent:
            continue
        away, near = cKDTree(points[first]).query(points[second], distance_upper_bound=reach)
        at = int(away.argmin())
        if away[at] > reach or _stands_between(labels, (a, b), first[near[at]], second[at]):
            continue
        worth = sum(labels.energy(labels.pieces[k], m) for k, m in ((a, first), (b, second)))
        both = np.sort(np.concatenate([first, second]))
        piece, _ = piece_of_least_kind(labels, both, _LAWS, worth)
        if piece is not None:
            labels.of[second], labels.pieces[a] = a, piece
            labels.mark_fitted(a, both)
            members[a], members[b] = both, second[:0]
            united += 1
    return united


def _alike(labels: Labels, members) -> list[tuple[int, int]]:
    """Pairs of labels of planes, spheres and cylinders; the one of more samples first. Two that are
    settled were not united before."""
    order = np.argsort([-len(mine) for mine in members], kind="stable").tolist()
    order = [k for k in order if len(members[k]) and labels.pieces[k].kind in _LAWS]
    settled = {k for k in order if labels.is_settled(k, members[k])}
    return [pair for pair in combinations(order, 2) if not settled.issuperset(pair)]


def _stands_between(labels: Labels, pair, first: int, second: int) -> bool:
    """Whether a sample between two others, no farther from the way than they are from each other,
    is of another face that crosses the way or faces as they do."""
    points = labels.evidence.samples.points
    way, offset = points[second] - points[first], points - points[first]
    square = max(float(way @ way), float(np.finfo(float).tiny))
    along = offset @ way / square
    beside = (offset * offset).sum(axis=1) - along * along * square
    noise = _NOISE * labels.evidence.samples.std / np.sqrt(square)
    inside = (along > -noise) & (along < 1.0 + noise) & (beside < square)
    inside &= ~np.isin(labels.of, [NONE, *pair])
    own = labels.pieces[pair[0]]
    outward = own.at(points[[first]])[1][0]
    for label in np.unique(labels.of[inside]).tolist():
        at = points[inside & (labels.of == label)]
        # Samples on the face itself: a third part, or a contour that was given another piece.
        if (np.abs(own.at(at)[0]) < _NOISE * labels.evidence.samples.std).all():
            continue
        _, normals = labels.pieces[label].at(at)
        crosses = np.abs(normals @ way) > _IN_THE_WAY * np.sqrt(square)
        stands = (crosses | (normals @ outward > _ALIKE)).any()
        if stands and not _lies_on_larger(labels, label):
            return True
    return False


def _lies_on_larger(labels: Labels, label: int) -> bool:
    """Whether all samples of a label lie on the lawful piece of one with more of them: a contour
    whose sampling plane touches a face shows none of its normals, and gets a piece across it."""
    members = labels.all_members()
    points = labels.evidence.samples.points[members[label]]
    noise = _NOISE * labels.evidence.samples.std
    return any(
        len(mine) > len(points)
        and labels.pieces[k].kind in _LAWS
        and bool((np.abs(labels.pieces[k].at(points)[0]) < noise).all())
        for k, mine in enumerate(members)
    )
