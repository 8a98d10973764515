"""Splitting: several pieces for the samples of one label, where the description becomes shorter."""

import numpy as np

from touchatlas.atlas.labels.grow import Growth, evenly, grow_at
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.cover import greedy_cover

# Seeds at which a label is tried apart. Doubled, narrow parts are found more often.
_SPLIT_SEEDS = 10
# Fraction of a label that the growths of its first three seeds must hold together: parts of fewer
# parameters are few, and large. Doubled, narrow parts are missed.
_HOPEFUL = 0.3
# Labels of fewer samples are always tried apart, if their kind has many parameters. Doubled, twice
# as many are tried.
_SMALL = 1000
# Overlap with a label that was tried apart before, in vain. Doubled (its distance from 1), fewer
# are tried again.
_TRIED = 0.8


def split(labels: Labels, tried: list[np.ndarray]) -> int:
    """Replace labels by several of fewer parameters where the description becomes shorter; returns
    how many. ``tried`` keeps those that were tried in vain."""
    done = 0
    for label, members in enumerate(labels.all_members()):
        if not _worth_splitting(labels, label, members, tried):
            continue
        tried.append(members)
        chosen = _apart(labels, label, members)
        if len(chosen) < 2:
            continue
        before = labels.of.copy(), list(labels.pieces)
        cost = labels.energy(labels.pieces[label], members)
        cost += _boundary_cost(labels, members)
        labels.of[members] = NONE
        for growth in chosen:
            labels.add(growth.piece, growth.members[labels.of[growth.members] == NONE])
        _relabel(labels, members, range(len(before[1]), len(labels.pieces)))
        after = _boundary_cost(labels, members)
        after += labels.loose_costs[members[labels.of[members] == NONE]].sum()
        for new in range(len(before[1]), len(labels.pieces)):
            part = labels.members(new)
            after += labels.energy(labels.pieces[new], part) if len(part) else 0.0
        if after < cost:
            done += 1
        else:
            labels.of, labels.pieces = before
    return done


def _worth_splitting(labels: Labels, label: int, members, tried) -> bool:
    """Whether a label has too large a misfit, or so many parameters that fewer may do."""
    piece = labels.pieces[label]
    if len(members) < 30 or labels.is_settled(label, members):
        return False
    distance = piece.at(labels.evidence.samples.points[members])[0] / labels.evidence.samples.std
    evidence = labels.evidence
    good = evidence.is_good(evidence.options.unexplained - evidence.misfit(distance))
    if good and (piece.kind < Kind.QUADRIC or len(members) > _SMALL):
        return False
    return not any(
        len(np.intersect1d(members, old)) > _TRIED * max(len(members), len(old)) for old in tried
    )


def _apart(labels: Labels, label: int, members) -> list[Growth]:
    """Growths of fewer parameters inside a label that together save most."""
    evidence, piece = labels.evidence, labels.pieces[label]
    distance = piece.at(evidence.samples.points[members])[0] / evidence.samples.std
    good = evidence.is_good(evidence.options.unexplained - evidence.misfit(distance))
    kind = min(piece.kind, Kind.CYLINDER) if good else piece.kind
    allowed = np.zeros(len(labels.of), bool)
    allowed[members] = True
    covered = np.zeros(len(labels.of), bool)
    proposals: list[Growth] = []
    seeds = evenly(members, 2 * _SPLIT_SEEDS)[1::2]
    # The first three are far from each other.
    for number, seed in enumerate(np.roll(seeds.reshape(-1, 5), 2, axis=1).T.ravel().tolist()):
        held = sum(len(growth.members) for growth in proposals)
        if number == 3 and held < _HOPEFUL * len(members):
            return []
        if covered[seed]:
            continue
        growth = grow_at(evidence, seed, kind, allowed)
        if growth is not None and growth.gain > 0.0:
            proposals.append(growth)
            covered[evidence.graph.interior(growth.members)] = True
    return greedy_cover(evidence, proposals, len(labels.of)) if len(proposals) > 1 else []


def _relabel(labels: Labels, members, choice) -> None:
    """Give samples the label that costs least among a few, beside their neighbours'."""
    options, graph = labels.evidence.options, labels.graph
    own = np.ones(len(members), bool)
    costs = [labels.loose_costs[members]]
    costs += [labels.costs(labels.pieces[k], members, own) for k in choice]
    names = np.array([NONE, *choice])
    labels.of[members] = names[np.argmin(costs, axis=0)]
    for sweep in range(8):
        around = np.append(labels.of, -2)[graph.neighbours[members]]
        weights = graph.neighbour_weights[members]
        same = [(weights * (around == name)).sum(axis=1) for name in names]
        new = names[np.argmin(np.array(costs) - options.boundary * np.array(same), axis=0)]
        now = np.arange(len(members)) % 2 == sweep % 2
        labels.of[members[now]] = new[now]


def _boundary_cost(labels: Labels, members) -> float:
    """Nats for the links of samples to those of other labels; inner links count once."""
    graph = labels.graph
    inside = graph.mask(members)
    inside[-1] = False
    touched = inside[graph.pairs].any(axis=1)
    both = labels.of[graph.pairs[touched]]
    weights = graph.weights[touched][both[:, 0] != both[:, 1]]
    return labels.evidence.options.boundary * float(weights.sum())
