"""Revisions of a labelling: fit pieces again, drop labels, and add some where nothing explains."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.labels.grow import Evidence, grow_at, is_edge
from touchatlas.atlas.labels.labels import NONE, Labels, is_larger
from touchatlas.atlas.pieces.kinds import LABEL_KINDS
from touchatlas.atlas.pieces.piece import Piece

# Least number of unexplained samples that hang together for a new seed. Doubled, small corners stay
# unexplained.
_CLUSTER = 6
# Root mean square by which a kind of more parameters must follow the samples of a label more
# closely, in deviations of a sample: errors of neighbouring samples are alike, and a few of many
# have a wrong label. Doubled, slightly bent faces are planes.
_BORNE = 0.25
# Seeds of such a cluster. Doubled, narrow faces are found a touch earlier, and looking for them
# takes longer.
_SEEDS = 2
# Samples of a cluster for each further seed. Doubled, faces in large clusters are found later.
_A_SEED = 40


def refit(labels: Labels) -> None:
    """Fit each label again to its interior, by the kind of least description up to its own."""
    for label, members in enumerate(labels.all_members()):
        if labels.is_fitted(label, members):
            continue
        best = _shortest(labels.evidence, labels.pieces[label], members)
        if best is not None:
            labels.replace(label, best)
        elif len(members) and is_edge(
            labels.pieces[label], labels.evidence.samples.points[members]
        ):
            # Few samples of two faces were explained by one that bends; new ones show the edge.
            labels.of[members] = NONE
        labels.mark_fitted(label, members)


def _shortest(evidence: Evidence, own: Piece, members) -> Piece | None:
    """The piece of least description for the samples of another, of its kind or one of fewer
    parameters; None where its kind shows an edge, or there are too few samples for any."""
    best, least = None, np.inf
    for kind in LABEL_KINDS:
        core = evidence.fitting_core(kind, members)
        if kind > own.kind or len(core) < kind.parameters + 2:
            continue
        piece = evidence.fit(kind, core)
        if piece is None and kind is own.kind and not is_edge(own, evidence.samples.points[core]):
            # It is compared as it was fitted before.
            piece = own
        if piece is None:
            best = None if kind is own.kind else best
            continue
        distance = piece.at(evidence.samples.points[core])[0] / evidence.samples.std
        cost = evidence.misfit(distance).mean() * len(members)
        cost += evidence.price(kind, len(members))
        borne = 0.0 if best is None else 0.5 * _BORNE**2 * len(members)
        if cost < least - borne:
            best, least = piece, cost
    return best


def drop(labels: Labels) -> int:
    """Give up labels that save less than they cost when their samples go to neighbours; returns how
    many."""
    evidence, dropped = labels.evidence, 0
    options, graph = evidence.options, evidence.graph
    sizes = np.bincount(labels.of[labels.of >= 0], minlength=len(labels.pieces))
    for label in np.argsort(sizes, kind="stable").tolist():
        members = labels.members(label)
        if not len(members) or labels.is_settled(label, members):
            continue
        around = labels.of[graph.neighbours[members].clip(max=graph.size - 1)]
        around[graph.neighbours[members] == graph.size] = label
        none = np.zeros(len(members), bool)
        best, to = labels.loose_costs[members], np.full(len(members), NONE)
        for other in np.unique(around):
            if other in (NONE, label):
                continue
            cost = labels.costs(labels.pieces[other], members, none)
            lower = cost < best
            best[lower], to[lower] = cost[lower], other
        own = np.minimum(labels.costs(labels.pieces[label], members, ~none), options.unexplained)
        links = graph.neighbour_weights[members][around != label].sum()
        boundary = 0.5 * options.boundary * links
        saved = best.sum() - own.sum() - boundary
        if saved < evidence.price(labels.pieces[label].kind, len(members)):
            labels.of[members] = to
            dropped += 1
    return dropped


def add(labels: Labels) -> int:
    """New labels that grow from unexplained samples that hang together, first where these are
    densest; returns how many."""
    evidence, size = labels.evidence, len(labels.of)
    pairs = evidence.graph.pairs
    loose = (labels.of == NONE) & ~labels.rounded
    low, high = pairs[loose[pairs].all(axis=1)].T
    links = coo_matrix((np.ones(len(low)), (low, high)), shape=(size, size))
    _, part = connected_components(links, directed=False)
    amid = _amid_loose(labels, loose)
    added, covered = 0, np.zeros(size, bool)
    for cluster in np.flatnonzero(np.bincount(part[loose]) >= _CLUSTER):
        members = np.flatnonzero(loose & (part == cluster))
        before = int(np.count_nonzero(labels.loose_before[members]))
        if before >= _CLUSTER and not is_larger(len(members), before):
            continue
        left = _SEEDS + len(members) // _A_SEED
        for seed in members[np.argsort(-amid[members], kind="stable")].tolist():
            if not left:
                break
            if covered[seed] or seed in labels.tried:
                continue
            left -= 1
            labels.tried.add(seed)
            covered[evidence.graph.around(np.array([seed]), 1)] = True
            growth = grow_at(evidence, seed)
            if growth is None:
                continue
            covered[growth.members] = True
            free = labels.of[growth.members] == NONE
            price = evidence.price(growth.piece.kind, len(growth.members))
            if growth.saved[free].sum() > price:
                labels.add(growth.piece, growth.members[free])
                added += 1
    return added


def _amid_loose(labels: Labels, loose) -> np.ndarray:
    """(n,) how many ways of two links lead from each sample to loose ones (n,) over loose ones: a
    growth that starts among samples of its own face finds it."""
    neighbours = labels.evidence.graph.neighbours
    once = np.append(loose, False)[neighbours].sum(axis=1) * loose
    return np.asarray(np.append(once, 0)[neighbours].sum(axis=1) * loose)
