"""Absorbing: labels whose samples a rounded edge explains at a lower price are given up."""

from itertools import combinations

import numpy as np

from touchatlas.atlas.edges.blunt_edges import BluntEdge, Rounding
from touchatlas.atlas.edges.crossings import Crossings, runs_of
from touchatlas.atlas.labels.grow import evenly
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind

# Samples of a label that tell whether it lies on another piece. Doubled, it takes longer.
_COMPARED = 100
# Nats that are saved, an edge, and the labels that it makes needless.
_Offer = tuple[float, BluntEdge, set[int]]


def absorb(labels: Labels) -> int:
    """Give up the labels whose samples a rounded edge explains at a lower price; returns how many.

    The edge that saves most is taken first. Its pieces get what lies beside its rounding. Each
    round leaves a label without samples, so that there are no more rounds than labels.
    """
    absorbed = 0
    while True:
        rounding = Rounding(labels)
        offers = _between(rounding) or _beside(rounding) or _beyond(rounding) or _within(rounding)
        if not offers:
            return absorbed
        _, edge, given = max(offers, key=lambda offer: offer[0])
        for label in sorted(given):
            rounding.give(edge, label)
        absorbed += len(given)


def _between(rounding: Rounding) -> list[_Offer]:
    """Edges that make the labels between their pieces needless."""
    offers = [_needless(rounding, pair, some) for pair, some in rounding.crossings.items()]
    return [offer for offer in offers if offer is not None]


def _needless(rounding: Rounding, pair, crossings: Crossings) -> _Offer | None:
    """The edge of a pair of labels, and the labels between them that it makes needless."""
    between = rounding.labels.of[crossings.samples]
    given = set(between.tolist()) - {NONE, *pair}
    while given:
        edge = rounding.edge(pair[0], pair[1], crossings, given)
        if edge is None:
            break
        kept = {k for k in given if rounding.saved_by(edge, k) > 0.0}
        if kept == given:
            return edge.saved, edge, given
        given = kept
    return None


def _beside(rounding: Rounding) -> list[_Offer]:
    """Edges that explain, with one of their pieces, another label: contours that end beside an edge
    may have made one of a part of its rounding and a part of the piece."""
    labels, out = rounding.labels, []
    linked = {pair[:2] for pair in labels.pairs()}
    for edge in rounding.edges:
        pair = edge.first, edge.second
        beside = {k for two in linked if set(two) & set(pair) for k in two}
        # The ball in a corner may be linked to samples without a label alone.
        beside |= set(labels.of[labels.graph.around(edge.samples, 1)].tolist())
        for label in sorted(beside - {NONE, *pair}):
            saved = rounding.saved_by(edge, label)
            if saved > 0.0:
                out.append((saved, edge, {label}))
    return out


def _beyond(rounding: Rounding) -> list[_Offer]:
    """Edges that explain, with one of their pieces, the label that stands for this piece where
    contours run over the edge."""
    labels, out = rounding.labels, []
    linked = {frozenset(pair[:2]) for pair in labels.pairs()}
    for pair, crossings in rounding.crossings.items():
        for own, label in (pair, pair[::-1]):
            for other in range(len(labels.pieces)):
                apart = other == own or frozenset((label, other)) not in linked
                if apart or not _is_partly(labels, label, other):
                    continue
                edge = rounding.edge(min(own, other), max(own, other), crossings, {label})
                if edge is not None and rounding.saved_by(edge, label) > 0.0:
                    out.append((edge.saved, edge, {label}))
    return out


def _within(rounding: Rounding) -> list[_Offer]:
    """Edges that explain a label on which contours from both their pieces end, and which none runs
    over; where more edges of the body have a radius than there are such labels, so that corners are
    explained, too."""
    labels, out = rounding.labels, []
    beside: dict[int, set[int]] = {}
    for one, other in rounding.crossings:
        beside.setdefault(one, set()).add(other)
        beside.setdefault(other, set()).add(one)
    for label, others in sorted(beside.items()):
        crossings = runs_of(labels, label)
        for pair in combinations(sorted(others), 2):
            if pair in rounding.crossings or labels.pieces[label].kind is Kind.PLANE:
                continue
            edge = rounding.edge(*pair, crossings, {label})
            if edge is not None and rounding.saved_by(edge, label) > 0.0:
                out.append((edge.saved, edge, {label}))
    return out if len(rounding.edges) > len(out) else []


def _is_partly(labels: Labels, label: int, other: int) -> bool:
    """Whether most samples of a label lie on another, lawful piece."""
    piece, evidence = labels.pieces[other], labels.evidence
    some = evenly(labels.members(label), _COMPARED)

    def lies_on_it() -> bool:
        distance = evidence.compare(piece, some)[0]
        return bool(np.median(np.abs(distance)) < evidence.options.gate)

    return piece.kind.lawful and evidence.recall.get(lies_on_it, "on", piece, some) is True
