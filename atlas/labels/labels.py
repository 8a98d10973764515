"""Labels: which piece explains each sample, by iterated conditional modes (Besag 1986), and the
length of that description."""

from collections.abc import Iterable

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.tried import NEW, NONE, Tried
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import first_largest

# Links over which a piece may take samples from its neighbours in one run of sweeps.
_BAND = 4
# Least part of a label that stays one when it falls apart, and number of samples that is enough
# whatever the rest: it may be the top of another block.
_PART, _ENOUGH = 0.15, 60


class Labels:
    """Pieces, and the number of the piece of each sample.

    Parameters
    ----------
    evidence : Evidence

    Attributes
    ----------
    pieces : list of Piece
    of : (n,) int
        Index of the piece, or NONE.
    loose : (n,) float
        Nats of each sample without a label: little for those on the rounding of an edge, so that
        no piece bends to explain them again.
    moved, given : Tried
        With which labels moves were last tried, and which were last offered to rounded edges.
    """

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        self.pieces: list[Piece] = []
        self.of = np.full(len(evidence.samples), NONE)
        self.loose = np.full(len(evidence.samples), evidence.options.unexplained)
        self.moved = self.given = Tried(np.full(len(self.of), NEW))

    def resume(self, pieces: list[Piece], of) -> None:
        """Go on from an earlier labelling (m,) of the first samples by its pieces."""
        self.pieces = list(pieces)
        self.of[: len(of)] = of
        since = self.of.copy()
        since[len(of) :] = NEW
        self.moved = self.given = Tried(since, self.pairs())

    def round(self, some, nats) -> None:
        """Say that the rounding of an edge explains samples (k,) for so many nats (k,)."""
        self.loose[some] = np.minimum(self.loose[some], nats)

    @property
    def rounded(self) -> np.ndarray:
        """(n,) whether the rounding of an edge explains a sample where no piece does."""
        return np.asarray(self.loose < self.evidence.options.unexplained)

    @property
    def lawful_share(self) -> float:
        """Fraction of the samples that lawful pieces explain."""
        lawful = [label for label, piece in enumerate(self.pieces) if piece.kind.lawful]
        return float(np.isin(self.of, lawful).mean())

    def members(self, label: int) -> np.ndarray:
        """The samples of a label, ascending."""
        return np.flatnonzero(self.of == label)

    def all_members(self) -> list[np.ndarray]:
        """The samples of each label."""
        order = np.argsort(self.of, kind="stable")
        bounds = np.searchsorted(self.of[order], np.arange(len(self.pieces) + 1))
        return [order[a:b] for a, b in zip(bounds[:-1], bounds[1:], strict=True)]

    def add(self, piece: Piece, members) -> None:
        """One more label for samples."""
        self.of[members] = len(self.pieces)
        self.pieces.append(piece)

    def pairs(self) -> list[tuple[int, int]]:
        """Labels that are linked, lower first."""
        both = np.sort(self.of[self.evidence.graph.pairs], axis=1)
        apart = (both[:, 0] != both[:, 1]) & (both[:, 0] >= 0)
        return [(int(a), int(b)) for a, b in np.unique(both[apart], axis=0)]

    def relax(self) -> None:
        """Give each sample about a boundary of labels, or far from its piece, the label that costs
        least beside its neighbours', until none changes."""
        graph, members = self.evidence.graph, self.all_members()
        at_boundary = self.of[graph.pairs[:, 0]] != self.of[graph.pairs[:, 1]]
        far = [np.flatnonzero(self.of == NONE), np.unique(graph.pairs[at_boundary])]
        for piece, mine in zip(self.pieces, members, strict=True):
            far.append(mine[self.costs(piece, mine, True) > self.loose[mine]])
        movable = graph.around(np.unique(np.concatenate(far)), _BAND)
        moves = graph.mask(movable)[:-1]
        bands = []
        for mine in members:
            band = graph.around(mine[moves[mine]], _BAND)
            bands.append(band[moves[band]])
        self.settle(movable, dict(enumerate(bands)))

    def settle(self, movable, bands: dict[int, np.ndarray]) -> None:
        """Give each movable sample (m,) none or one of the labels among whose ``bands`` (k,) it is,
        by iterated conditional modes."""
        columns = [(movable, np.full(len(movable), NONE), self.loose[movable])]
        for label, band in bands.items():
            cost = self.costs(self.pieces[label], band, self.of[band] == label)
            usable = np.isfinite(cost)
            columns.append((band[usable], np.full(usable.sum(), label), cost[usable]))
        sample, name, cost = (np.concatenate(column) for column in zip(*columns, strict=True))
        order = np.lexsort((name, sample))
        price = self.evidence.options.boundary
        candidates = sample[order], name[order], cost[order]
        self.of = iterated_conditional_modes(self.evidence.graph, self.of, *candidates, price)

    def costs(self, piece: Piece, members, own) -> np.ndarray:
        """(m,) nats of the distances of samples from a piece; infinite where it may not be their
        label. ``own`` (m,) says whose label it is: there the piece may be unsure."""
        distance, cosine, variance = self.evidence.compare(piece, members)
        sure = own | (variance < (2.0 * self.evidence.options.doubt) ** 2)
        facing = cosine > self.evidence.facing
        return np.where(facing & sure, 0.5 * distance**2, np.inf)

    def separate(self) -> None:
        """Give each large connected part of a label its own label, and none to small ones."""
        size, pairs = len(self.of), self.evidence.graph.pairs
        first, second = self.of[pairs].T
        low, high = pairs[(first == second) & (first >= 0)].T
        links = coo_matrix((np.ones(len(low)), (low, high)), shape=(size, size))
        _, part = connected_components(links, directed=False)
        old, new = self.all_members(), np.full(size, NONE)
        pieces: list[Piece] = []
        for piece, members in zip(self.pieces, old, strict=True):
            counts = np.bincount(part[members])
            least = max(min(_PART * len(members), _ENOUGH), piece.kind.parameters + 4)
            large = np.flatnonzero(counts >= least)
            for k in large[np.argsort(-counts[large], kind="stable")]:
                new[members[part[members] == k]] = len(pieces)
                pieces.append(piece)
        self.of, self.pieces = new, pieces

    def drop_empty(self) -> None:
        """Drop the labels that no sample has."""
        used, of = np.unique(self.of, return_inverse=True)
        first = int(used[0] == NONE)
        self.of = of.ravel() - first
        self.pieces = [self.pieces[k] for k in used[first:]]

    def length(self, members, some: Iterable[int]) -> float:
        """Nats of samples (m,) and of their links to all others, and of the parameters of ``some``
        labels."""
        of, evidence, graph = self.of[members], self.evidence, self.evidence.graph
        cost = float(self.loose[members[of == NONE]].sum())
        for label in np.unique(of[of != NONE]).tolist():
            cost += float(evidence.nats(self.pieces[label], members[of == label]).sum())
        counts = np.bincount(self.of[self.of >= 0], minlength=len(self.pieces))
        used = [label for label in some if label < len(counts) and counts[label]]
        cost += sum(evidence.price(self.pieces[k].kind, int(counts[k])) for k in used)
        weights, around = graph.neighbour_weights[members], graph.neighbours[members]
        # A link of two of the samples is met twice.
        share = np.where(graph.mask(members)[around], 0.5, 1.0)
        apart = np.append(self.of, NONE)[around] != of[:, None]
        return cost + evidence.options.boundary * float((weights * share * apart).sum())

    def total(self) -> float:
        """Nats of the whole description: what labelling makes small."""
        return self.length(np.arange(len(self.of)), range(len(self.pieces)))


def iterated_conditional_modes(graph, of, sample, label, cost, price: float) -> np.ndarray:
    """Labels (n,) after each sample took the one of least energy, until none changes.

    Even samples change first, then odd ones: neighbours on a contour never change together. After
    two sweeps only neighbours of samples that changed are evaluated. A label spreads from neighbour
    to neighbour.

    Parameters
    ----------
    graph : SampleGraph
    of : (n,) int
        The labels to begin with.
    sample, label : (m,) int
        Samples and the labels that each may take, ordered by both.
    cost : (m,) float, nats
    price : float, nats
        Of a link between two labels (Potts model).
    """
    of, still = np.append(of, -2), 0
    entry, column = np.nonzero(graph.neighbours[sample] < graph.size)
    around = graph.neighbours[sample[entry], column]
    weights = graph.neighbour_weights[sample[entry], column]
    stirred = np.ones(len(of), bool)
    for sweep in range(24 if len(sample) else 0):
        turn = stirred[sample] & (sample % 2 == sweep % 2)
        rows, some = np.flatnonzero(turn), np.flatnonzero(turn[entry])
        at = (np.cumsum(turn) - 1)[entry[some]]
        own, name = sample[rows], label[rows]
        same = of[around[some]] == name[at]
        energy = cost[rows] - price * np.bincount(at, weights[some] * same, len(rows))
        alone = np.bincount(at, same, len(rows)) == 0
        energy[alone & (name != NONE) & (name != of[own])] = np.inf
        # The first of equals, by label.
        best = rows[first_largest(-energy, np.flatnonzero(np.diff(own, prepend=-1)))]
        changed = best[label[best] != of[sample[best]]]
        of[sample[changed]] = label[changed]
        stirred[own] = False
        stirred[graph.neighbours[sample[changed]]] = True
        still = 0 if len(changed) else still + 1
        if still == 2:
            break
    return np.asarray(of[:-1])
