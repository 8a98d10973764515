"""Merging: one piece for the samples of two labels, where the description becomes shorter."""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.edges.crossings import crossed_pairs
from touchatlas.atlas.labels.grow import Evidence, evenly
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import LABEL_KINDS, Kind
from touchatlas.atlas.pieces.piece import Piece

# Most samples by which a merged piece is fitted and first judged. Doubled, it takes twice as long.
_JUDGED = 800
# Least fraction of samples whose normals agree with a merged piece within 60 degrees. Doubled (its
# distance from 1), pieces are merged round edges with few samples.
_AGREEING, _AGREES = 0.995, 0.5
# Samples farther off than this, in standard deviations, are left out of a second fit. Doubled, bad
# samples bend merged pieces.
_OUTLYING = 3.5


def merge(labels: Labels) -> int:
    """Merge linked labels while the description becomes shorter; returns how many."""
    merged = 0
    while True:
        found, apart = [], _about_roundings(labels)
        members = labels.all_members()
        costs = [labels.energy(p, m) for p, m in zip(labels.pieces, members, strict=True)]
        settled = [labels.is_settled(k, m) for k, m in enumerate(members)]
        for a, b, links in labels.pairs():
            if (a, b) in apart:
                continue
            if settled[a] and settled[b] and labels.is_settled_pair(a, b):
                continue
            key = members[a].tobytes(), members[b].tobytes()
            if hash(key) in labels.tried:
                continue
            labels.tried.add(hash(key))
            saved = costs[a] + costs[b] + labels.evidence.options.boundary * links
            kinds = labels.pieces[a].kind, labels.pieces[b].kind
            both = np.sort(np.concatenate([members[a], members[b]]))
            piece, cost = merged_piece(labels, both, kinds, saved)
            if piece is not None and cost < saved:
                found.append((saved - cost, a, b, piece))
        if not found:
            return merged
        used: set[int] = set()
        for _, a, b, piece in sorted(found, key=lambda f: (-f[0], f[1], f[2])):
            if not used & {a, b}:
                used |= {a, b}
                labels.of[labels.of == b] = a
                labels.pieces[a] = piece
                merged += 1


def _about_roundings(labels: Labels) -> set[tuple[int, int]]:
    """Pairs of labels between which a contour runs over a rounded edge and nothing else."""
    if not labels.rounded.any():
        return set()
    return crossed_pairs(labels, labels.rounded & (labels.of == NONE))


def merged_piece(labels: Labels, both, kinds, worth: float) -> tuple[Piece | None, float]:
    """The first kind whose piece explains the samples of two labels for less than ``worth`` nats,
    and what it costs."""
    if _hopeless(labels.evidence, both, min(kinds), worth):
        return None, np.inf
    high = max(kinds)
    first = {Kind.QUARTIC: Kind.QUARTIC, Kind.QUADRIC: Kind.QUADRIC}.get(high, min(kinds))
    return piece_of_least_kind(labels, both, [kind for kind in LABEL_KINDS if kind >= first], worth)


def piece_of_least_kind(
    labels: Labels, both, kinds: Iterable[Kind], worth: float
) -> tuple[Piece | None, float]:
    """The first of some kinds whose piece explains samples for less than ``worth`` nats, and what
    it costs."""
    evidence = labels.evidence
    for kind in kinds:
        core = evenly(evidence.fitting_core(kind, both), _JUDGED)
        if len(core) < kind.parameters + 4:
            continue
        piece = _robust_fit(evidence, kind, core)
        if piece is None:
            continue
        sample = evenly(both, _JUDGED)
        distance, cosine, _ = evidence.compare(piece, sample)
        if not evidence.is_good(evidence.options.unexplained - evidence.misfit(distance)):
            continue
        price = evidence.price(kind, len(both))
        # What the judged samples cost already, with the rest for nothing.
        if evidence.misfit(distance).sum() + price > worth:
            continue
        if np.mean(cosine > _AGREES) < _AGREEING:
            continue
        cost = labels.energy(piece, both)
        if cost < worth:
            return piece, cost
    return None, np.inf


def _hopeless(evidence: Evidence, both, least: Kind, worth: float) -> bool:
    """Whether even a quartic, at the price of the least kind, explains samples for no less."""
    core = evenly(evidence.fitting_core(Kind.QUARTIC, both), _JUDGED)
    if len(core) < Kind.QUARTIC.parameters + 4:
        return False
    piece = _robust_fit(evidence, Kind.QUARTIC, core)
    if piece is None:
        return False
    sample = evenly(both, _JUDGED)
    misfit = evidence.misfit(evidence.compare(piece, sample)[0]).sum() * len(both) / len(sample)
    return bool(misfit + evidence.price(least, len(both)) > worth)


def _robust_fit(evidence: Evidence, kind: Kind, members) -> Piece | None:
    """A fit without the samples that are far off a first one."""
    piece = evidence.fit(kind, members)
    if piece is None:
        return None
    distance = piece.at(evidence.samples.points[members])[0] / evidence.samples.std
    good = members[np.abs(distance) < _OUTLYING]
    if not 0.7 * len(members) < len(good) < len(members):
        return piece
    return evidence.fit(kind, good)
