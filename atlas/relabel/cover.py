"""Proposals from seeds, and the greedy choice among them by description length."""

import numpy as np

from touchatlas.atlas.labels.grow import Evidence, Growth, grow_at
from touchatlas.atlas.pieces.kinds import Kind

# Nearest samples by which seeds are put in order. Doubled, seeds in narrow faces come last.
_LOCAL = 24


def seeds_of(evidence: Evidence) -> np.ndarray:
    """The middle of the first contour of each touch, the best explained about it first."""
    samples = evidence.samples
    first = np.flatnonzero(np.diff(samples.touches, prepend=-1))
    last = np.searchsorted(samples.contours, samples.contours[first], side="right")
    middle = (first + last) // 2
    order = np.argsort([_local_cost(evidence, int(i)) for i in middle], kind="stable")
    return middle[order]


def _local_cost(evidence: Evidence, seed: int) -> float:
    """Least nats of a plane or a quadric for the samples about one."""
    near = evidence.graph.nearest(evidence.samples.points, seed, _LOCAL)
    costs = []
    for kind in (Kind.PLANE, Kind.QUADRIC):
        piece = evidence.fit(kind, near)
        if piece is None:
            continue
        distance = piece.at(evidence.samples.points[near])[0] / evidence.samples.std
        costs.append(evidence.misfit(distance).sum() + evidence.price(kind, len(near)))
    return float(min(costs)) / len(near)


def propose(evidence: Evidence, seeds) -> list[Growth]:
    """Growths at seeds that lie in the interior of none of the growths before."""
    covered = np.zeros(len(evidence.samples), bool)
    proposals = []
    for seed in seeds.tolist():
        if covered[seed]:
            continue
        covered[seed] = True
        growth = grow_at(evidence, seed)
        if growth is not None and growth.gain > 0.0:
            proposals.append(growth)
            covered[evidence.graph.interior(growth.members)] = True
    return proposals


def greedy_cover(evidence: Evidence, proposals: list[Growth], count: int) -> list[Growth]:
    """The growth that saves most of what is not explained yet, until none saves anything.

    Lazy greedy: what a growth saves can only fall (Minoux 1978). ``count`` is that of the
    samples.
    """
    left = np.ones(count, bool)
    price = np.array([evidence.price(g.piece.kind, len(g.members)) for g in proposals])
    saves = np.array([g.saved.sum() for g in proposals])
    chosen = []
    while len(proposals):
        k = int((saves - price).argmax())
        if not saves[k] > price[k]:
            break
        growth = proposals[k]
        now = float(growth.saved[left[growth.members]].sum())
        if now < saves[k]:
            saves[k] = now
            continue
        chosen.append(growth)
        left[growth.members], saves[k] = False, -np.inf
    return chosen
