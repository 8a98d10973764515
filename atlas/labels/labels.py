"""Labels: which piece explains each sample, by iterated conditional modes (Besag 1986)."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import first_largest

NONE = -1
# Links over which a piece may take samples from its neighbours in one run of sweeps. Doubled, twice
# as many samples are compared.
_BAND = 4
# Most sweeps; boundaries move by one link in each. Doubled, nothing changes.
_SWEEPS = 12
# Least cosine of normals within the sampling plane for a label: 46 degrees. Doubled, it allows no
# noisy normals beside edges.
_COSINE = 0.7
# Largest predicted deviation for a label, over that for a claim. Doubled, pieces speak farther
# beyond their samples.
_DOUBT = 2.0
# Price of a sample far from its piece, over that of an unexplained one. Doubled, nothing changes.
_WORST = 2.5
# Nats of a sample that lies on the rounding of an edge: half the mean square of its distance in
# deviations. Doubled, pieces bend over edges a little more often.
_ON_ROUNDING = 0.5
# Least part of a label that stays one when it falls apart, and number of samples that is enough
# whatever the rest: it may be the top of another block. Doubled, more samples lose their label.
_PART, _ENOUGH = 0.15, 60
# Growth of a number of samples, no unit, after which what was tried with them is tried again.
# Doubled, faces are found some touches later.
_GROWS = 1.25
# Share of the earlier samples of a label that must be left for it to be the same. Doubled (its
# distance from 1), labels that lost a fifth to a neighbour are not looked at.
_KEPT = 0.9
_NO_SAMPLES = np.zeros(0, int)


def is_larger(count: int, before: int) -> bool:
    """Whether a number of samples has passed a power of the growth after which things are tried
    again; what is added in small parts passes it as well."""
    steps = np.log(np.maximum([count, before], 1)) / np.log(_GROWS)
    return int(steps[0]) > int(steps[1])


class Labels:
    """Pieces, and the number of the piece of each sample.

    Parameters
    ----------
    evidence : Evidence

    Attributes
    ----------
    graph : SampleGraph
        The links over which labels spread: not those in whose way another label stands.
    pieces : list of Piece
    of : (n,) int
        Index of the piece, or NONE.
    """

    def __init__(self, evidence: Evidence) -> None:
        self.evidence, self.graph = evidence, evidence.graph
        self.pieces: list[Piece] = []
        # The links of all that are left out of the graph.
        self.cut = _NO_SAMPLES
        # Merges and seeds that were tried, and the samples that each piece was fitted to.
        self.tried: set = set()
        self.fitted: dict[Piece, np.ndarray] = {}
        self.of = np.full(len(evidence.samples), NONE)
        # What an earlier labelling left: the number and the samples of each of its pieces, the
        # pairs of numbers between which there were links, and the samples that had no label.
        self._before: dict[Piece, tuple[int, np.ndarray]] = {}
        self._linked: set[tuple[int, int]] = set()
        self.loose_before = np.zeros(len(evidence.samples), bool)
        self._new = np.ones(len(evidence.samples), bool)
        # Samples without a label that the rounding of an edge explained then.
        self.rounded = np.zeros(len(evidence.samples), bool)

    def resume(self, pieces: list[Piece], of, rounded=()) -> None:
        """Go on from an earlier labelling (m,) of the first samples by its pieces, of which some
        (k,) were explained by the rounding of edges. What has not changed since is not tried
        again."""
        self.pieces = list(pieces)
        self.rounded[np.asarray(rounded, int)] = True
        self.of[: len(of)] = of
        self.loose_before[: len(of)] = of == NONE
        self._new[: len(of)] = False
        members = self.all_members()
        self.fitted = dict(zip(self.pieces, members, strict=True))
        numbered = enumerate(zip(self.pieces, members, strict=True))
        self._before = {piece: (k, mine) for k, (piece, mine) in numbered}
        self._linked = {(a, b) for a, b, _ in self.pairs()}

    @property
    def state(self) -> tuple:
        """What tells whether labels changed."""
        return self.of.tobytes(), tuple(self.pieces), self.graph

    @property
    def loose_costs(self) -> np.ndarray:
        """(n,) nats of samples without a label: little for those on the rounding of an edge, so
        that no piece bends to explain them again."""
        return np.where(self.rounded, _ON_ROUNDING, self.evidence.options.unexplained)

    def is_settled(self, label: int, members) -> bool:
        """Whether a label is one of the earlier labelling with nearly the same samples: what was
        not worth while then is not tried again."""
        _, before = self._before.get(self.pieces[label], (NONE, _NO_SAMPLES))
        kept = np.count_nonzero(self.of[before] == label)
        if not kept or kept < _KEPT * len(before):
            return False
        return not is_larger(len(members), len(before))

    def is_settled_pair(self, one: int, other: int) -> bool:
        """Whether two settled labels were linked before."""
        names = [self._before[self.pieces[label]][0] for label in (one, other)]
        return (min(names), max(names)) in self._linked

    def replace(self, label: int, piece: Piece) -> None:
        """Give a label a piece that was fitted to its samples again."""
        own = self.pieces[label]
        # Where a label fell apart, what is left of it may have its piece.
        if own in self._before and self.pieces.count(own) == 1:
            self._before[piece] = self._before.pop(own)
        self.pieces[label] = piece

    @property
    def lawful_share(self) -> float:
        """Fraction of the samples that lawful pieces explain."""
        lawful = [label for label, piece in enumerate(self.pieces) if piece.kind.lawful]
        return float(np.isin(self.of, lawful).mean())

    def pieces_of(self, some) -> tuple[Piece | None, ...]:
        """The pieces of some labels, none of NONE."""
        return tuple(None if label == NONE else self.pieces[label] for label in some)

    def members(self, label: int) -> np.ndarray:
        """The samples of a label, ascending."""
        return np.flatnonzero(self.of == label)

    def is_fitted(self, label: int, members) -> bool:
        """Whether the piece of a label was fitted to these samples."""
        return np.array_equal(self.fitted.get(self.pieces[label], np.array([-1])), members)

    def mark_fitted(self, label: int, members) -> None:
        """Note that the piece of a label is fitted to these samples."""
        self.fitted[self.pieces[label]] = members

    def all_members(self) -> list[np.ndarray]:
        """The samples of each label."""
        order = np.argsort(self.of, kind="stable")
        bounds = np.searchsorted(self.of[order], np.arange(len(self.pieces) + 1))
        return [order[a:b] for a, b in zip(bounds[:-1], bounds[1:], strict=True)]

    def add(self, piece: Piece, members) -> None:
        """One more label for samples."""
        self.of[members] = len(self.pieces)
        self.pieces.append(piece)

    def pairs(self) -> list[tuple[int, int, float]]:
        """Labels that are linked, lower first, and the sum of the weights of their links."""
        both = np.sort(self.of[self.graph.pairs], axis=1)
        apart = (both[:, 0] != both[:, 1]) & (both[:, 0] >= 0)
        pairs, which = np.unique(both[apart], axis=0, return_inverse=True)
        sums = np.bincount(which.ravel(), self.graph.weights[apart], len(pairs))
        return [(int(a), int(b), float(w)) for (a, b), w in zip(pairs, sums, strict=True)]

    def relax(self) -> None:
        """Give each sample the label that costs least beside its neighbours', until none changes.

        Even samples change first, then odd ones: neighbours on a contour never change together.
        After the first two sweeps only neighbours of samples that changed are looked at.
        """
        movable = self._movable()
        sample, label, cost = self._candidates(movable)
        if not len(movable):
            return
        graph, price = self.graph, self.evidence.options.boundary
        of, still = np.append(self.of, -2), 0
        entry, column = np.nonzero(graph.neighbours[sample] < graph.size)
        around = graph.neighbours[sample[entry], column]
        weights = graph.neighbour_weights[sample[entry], column]
        stirred = np.ones(len(of), bool)
        for sweep in range(2 * _SWEEPS):
            turn = stirred[sample] & (sample % 2 == sweep % 2)
            rows, some = np.flatnonzero(turn), np.flatnonzero(turn[entry])
            at = (np.cumsum(turn) - 1)[entry[some]]
            own, name = sample[rows], label[rows]
            same = of[around[some]] == name[at]
            energy = cost[rows] - price * np.bincount(at, weights[some] * same, len(rows))
            # A label spreads from neighbour to neighbour.
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
        self.of = of[:-1]

    def _movable(self) -> np.ndarray:
        """Samples about boundaries of labels, or far from their piece, ascending."""
        graph, unsettled, loose = self.graph, self._is_unsettled(), self.loose_costs
        at_boundary = self.of[graph.pairs[:, 0]] != self.of[graph.pairs[:, 1]]
        far = [np.flatnonzero(self.of == NONE), np.unique(graph.pairs[at_boundary])]
        for piece, all_of_it in zip(self.pieces, self.all_members(), strict=True):
            members = all_of_it[unsettled[all_of_it]]
            cost = self.costs(piece, members, np.ones(len(members), bool))
            far.append(members[cost > loose[members]])
        start = np.unique(np.concatenate(far))
        return graph.around(start[unsettled[start]], _BAND)

    def _is_unsettled(self) -> np.ndarray:
        """(n,) whether a sample, or one it is linked to, is new or of a label that changed since
        the earlier labelling."""
        changed = self._new | (self.of == NONE) & ~self.loose_before
        for label, members in enumerate(self.all_members()):
            if not self.is_settled(label, members):
                changed[members] = True
        neighbours = np.append(changed, False)[self.graph.neighbours]
        return np.asarray(changed | neighbours.any(axis=1))

    def _candidates(self, movable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sample (m,), label (m,) and cost (m,) of each label that a movable sample may take,
        ordered by sample, with NONE among them."""
        moves = np.zeros(len(self.of), bool)
        moves[movable] = True
        samples, labels = [movable], [np.full(len(movable), NONE)]
        costs = [self.loose_costs[movable]]
        for label, members in enumerate(self.all_members()):
            inside = members[moves[members]]
            if not len(inside):
                continue
            band = self.graph.around(inside, _BAND)
            band = band[moves[band]]
            cost = self.costs(self.pieces[label], band, self.of[band] == label)
            usable = np.isfinite(cost)
            samples.append(band[usable])
            labels.append(np.full(int(usable.sum()), label))
            costs.append(cost[usable])
        sample, name = np.concatenate(samples), np.concatenate(labels)
        order = np.lexsort((name, sample))
        return sample[order], name[order], np.concatenate(costs)[order]

    def costs(self, piece: Piece, members, own) -> np.ndarray:
        """(m,) nats of the distances of samples from a piece; infinite where it may not be their
        label. ``own`` (m,) says whose label it is: these may be doubtful."""
        options = self.evidence.options
        distance, cosine, variance = self.evidence.compare(piece, members)
        cost = np.minimum(0.5 * distance**2, _WORST * options.unexplained)
        sure = own | (variance < (_DOUBT * options.doubt) ** 2)
        return np.where((cosine > _COSINE) & sure, cost, np.inf)

    def separate(self) -> None:
        """Give each large connected part of a label its own label, and none to small ones."""
        size, pairs = len(self.of), self.graph.pairs
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

    def energy(self, piece: Piece, members) -> float:
        """Nats of a piece that explains samples: their misfit and its parameters."""
        distance = piece.at(self.evidence.samples.points[members])[0] / self.evidence.samples.std
        price = self.evidence.price(piece.kind, len(members))
        return float(self.evidence.misfit(distance).sum()) + price

    def total(self) -> float:
        """Nats of the whole description: what labelling makes small."""
        options, graph = self.evidence.options, self.graph
        both = self.of[graph.pairs]
        cost = options.boundary * graph.weights[both[:, 0] != both[:, 1]].sum()
        cost += self.loose_costs[self.of == NONE].sum()
        pairs = zip(self.pieces, self.all_members(), strict=True)
        return float(cost) + sum(self.energy(piece, m) for piece, m in pairs if len(m))
