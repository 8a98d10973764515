"""Region growing (Besl and Jain 1988): the largest connected set of samples that one piece
explains, from a small start."""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece, in_plane_cosines
from touchatlas.patch.geometry.arrays import evenly

# Kinds that grow, as they are tried. Which law a quadric obeys is chosen when it is fitted again; a
# torus is no quadric, and begins with what a quartic explains.
_GROWING = Kind.PLANE, Kind.QUADRIC, Kind.QUARTIC, Kind.TORUS
# Most samples that are fitted: a mean of 400 is within a twentieth of a deviation.
_FITTED = 400
# Largest curvature of a flat place times the length of its piece, over the angle by which the piece
# faces another way elsewhere: ten times as much would turn it by that angle evenly.
_FLAT = 0.1
# Samples of a large growth: no kind of more parameters is tried, because growing takes longest.
_ENOUGH = 300


@dataclass(frozen=True, eq=False)
class Growth:
    """A piece, the samples that it claims (m,), ascending, what each saves (m,), and how much the
    piece saves in all, in nats."""

    piece: Piece
    members: np.ndarray
    saved: np.ndarray
    gain: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """Samples, their graph and what labels cost: what every step of the labelling reads.

    Parameters
    ----------
    samples : ContourSamples
    graph : SampleGraph
    recall : Recall
        What was computed of these samples before, by all that it depends on.
    options : FaceOptions
    """

    samples: ContourSamples
    graph: SampleGraph
    recall: Recall = field(default_factory=Recall)
    options: FaceOptions = FaceOptions()

    @property
    def facing(self) -> float:
        """Least cosine of two normals that face the same side."""
        return self.samples.levels.facing

    @property
    def sure(self) -> float:
        """Deviations beyond which a difference is sure."""
        return self.samples.levels.sure

    def fit(self, kind: Kind, members) -> Piece | None:
        """The piece of a kind for samples, at most 400 of them, evenly along the contours; None
        where there is none, or two planes and their edge would be one bent piece."""
        s = evenly(members, _FITTED)
        return self.recall.get(lambda: self._fit(kind, s), "fit", kind, s)

    def _fit(self, kind: Kind, s) -> Piece | None:
        points = self.samples.points[s]
        piece = fit_piece(kind, points, self.samples.normals[s], self.samples.stds[s])
        if piece is None or kind not in (Kind.QUADRIC, Kind.QUARTIC):
            return piece
        return None if is_edge(piece, points, 0.5 * self.samples.levels.same_side) else piece

    def compare(self, piece: Piece, members) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances over the deviation of each sample (m,), cosines of the normals (m,), and
        predicted variances over that of each (m,)."""
        samples = self.samples
        distance, normals, variance = piece.predicted(samples.points[members])
        cosines = in_plane_cosines(normals, samples.normals[members], samples.planes[members])
        std = samples.stds[members]
        return distance / std, cosines, variance / std**2

    def price(self, kind: Kind, count: int) -> float:
        """Nats for the parameters of a piece that explains ``count`` samples (Schwarz 1978)."""
        return 0.5 * kind.parameters * float(np.log(max(count, 2)))

    def misfit(self, distance) -> np.ndarray:
        """Nats for samples at such distances, in deviations, no more than unexplained ones."""
        return np.minimum(0.5 * distance**2, self.options.unexplained)

    def nats(self, piece: Piece, members) -> np.ndarray:
        """(m,) nats of samples that a piece explains."""
        distance = piece.at(self.samples.points[members])[0]
        return self.misfit(distance / self.samples.stds[members])

    def is_good(self, nats) -> bool:
        """Whether samples of so many nats (m,) are no farther off than chi-square allows."""
        excess = self.sure * np.sqrt(2.0 / len(nats))
        return bool(2.0 * nats.mean() < 1.0 + excess)

    def fitting_core(self, kind: Kind, members) -> np.ndarray:
        """The interior of the members, or all of them where it is too small to fit."""
        core = self.graph.interior(members)
        enough = max(2 * kind.parameters + 4, len(members) // 2)
        return core if len(core) >= enough else members


def is_edge(piece: Piece, points, angle: float) -> bool:
    """Whether a quadric or quartic is flat at most of its points (n, 3) and faces ways that differ
    by more than an angle (rad) at some: then it is two planes and a rounded edge, as a hyperbola
    is, and no law of all three."""
    normals = piece.at(points)[1]
    mean = normals.mean(axis=0)
    if (normals @ mean).min() > np.cos(0.5 * angle) * np.sqrt(mean @ mean):
        return False
    length = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    turn = length * piece.bends(points)
    flattest = normals[turn.argmin()]
    other = float(np.arccos(np.clip((normals @ flattest).min(), -1.0, 1.0)))
    return bool(other > angle and np.median(turn) < _FLAT * other)


def growths(
    evidence: Evidence, seeds, left, most: Kind = Kind.QUARTIC, inside=None
) -> list[Growth]:
    """Growths at seeds that lie in the interior of none before; of these the one that saves most of
    what is not explained yet, until none is worth its parameters.

    Parameters
    ----------
    evidence : Evidence
    seeds : (k,) int
    left : (n,) bool
        Samples that are not explained yet.
    most : Kind
        The kind of most parameters.
    inside : (n,) bool, optional
        Samples that may be claimed.
    """
    covered, found = np.zeros(len(left), bool), []
    for seed in seeds.tolist():
        if not covered[seed]:
            covered[evidence.graph.around(np.array([seed]), 1)] = True
            growth = _grow_at(evidence, seed, most, inside)
            if growth is not None and growth.gain > 0.0:
                found.append(growth)
                covered[evidence.graph.interior(growth.members)] = True
    return _worth_most(evidence, found, left)


def planes_from(evidence: Evidence, starts, left) -> list[Growth]:
    """The planes that grow from samples to start with, a list of (m,) int, chosen as in
    ``growths``. A start that one before explains is left out."""
    covered, found = np.zeros(len(left), bool), []
    for start in starts:
        if covered[start].all():
            continue
        growth = _grow(evidence, start, Kind.PLANE, None)
        if growth is not None and growth.gain > 0.0:
            found.append(growth)
            covered[growth.members] = True
    return _worth_most(evidence, found, left)


def _worth_most(evidence: Evidence, found: list[Growth], left) -> list[Growth]:
    """Of growths the one that saves most of what is left (n,), until none is worth its parameters
    (lazy greedy: Minoux 1978)."""
    price = np.array([evidence.price(g.piece.kind, len(g.members)) for g in found])
    saves = np.array([g.saved.sum() for g in found])
    left, chosen = left.copy(), []
    while found:
        k = int((saves - price).argmax())
        if not saves[k] > price[k]:
            break
        now = float(found[k].saved[left[found[k].members]].sum())
        if now < saves[k]:
            saves[k] = now
            continue
        chosen.append(found[k])
        left[found[k].members], saves[k] = False, -np.inf
    return chosen


def _grow_at(evidence: Evidence, seed: int, most: Kind, inside) -> Growth | None:
    """The best growth at a sample, or None. Each kind also starts from what the best so far
    explains, and must explain much more than it."""
    best: Growth | None = None
    for kind in _GROWING:
        if kind > most or not _is_worth_trying(kind, best):
            continue
        count = 3 * kind.parameters + 5
        start = evidence.graph.nearest(evidence.samples.points, seed, count)
        if inside is not None:
            start = start[inside[start]]
        if best is not None and len(best.members) > len(start):
            start = best.members
        growth = _grow(evidence, start, kind, inside)
        least = 0.0 if best is None else evidence.options.better * max(best.gain, 1.0)
        if growth is not None and (best is None or growth.gain > least):
            best = growth
    return best


def _is_worth_trying(kind: Kind, best: Growth | None) -> bool:
    """Whether a kind may explain more than the best growth so far."""
    if kind is Kind.TORUS:
        return best is not None and best.piece.kind is Kind.QUARTIC
    return best is None or len(best.members) < _ENOUGH


def _grow(evidence: Evidence, start, kind: Kind, inside) -> Growth | None:
    """The best growth of one kind from starting samples: a fit and a claim of what it explains, in
    turn, until the same samples are claimed."""
    graph, points = evidence.graph, evidence.samples.points
    members, best = start, None
    for _ in range(12):
        core = evidence.fitting_core(kind, members)
        piece = evidence.fit(kind, core) if len(core) >= kind.parameters + 4 else None
        if piece is None:
            break
        offset = points[members] - piece.origin
        reach = 2.0 * float(np.sqrt((offset * offset).sum(axis=1).max()))
        near = np.array(graph.tree.query_ball_point(piece.origin, reach, return_sorted=True))
        near = near if inside is None else near[inside[near]]
        claimed, nats = _claims(evidence, piece, near)
        grown = graph.connected(near[claimed], members)
        nats = nats[np.searchsorted(near, grown)]
        if len(grown) < kind.parameters + 4 or not evidence.is_good(nats):
            break
        saved = evidence.options.unexplained - nats
        gain = float(saved.sum()) - evidence.price(kind, len(grown))
        if best is None or gain > best.gain:
            best = Growth(piece, grown, saved, gain)
        common = np.count_nonzero(graph.mask(members)[grown])
        if common >= 0.99 * max(len(grown), len(members)):
            break
        members = grown
    return best


def _claims(evidence: Evidence, piece: Piece, near) -> tuple[np.ndarray, np.ndarray]:
    """Whether a piece may claim samples (m,), and the nats of each (m,): those that cost less than
    unexplained ones, alone and in the mean of five along the contour, and where the piece is
    sure."""
    options = evidence.options
    distance, cosine, variance = evidence.compare(piece, near)
    distance = np.clip(distance, -20.0, 20.0)
    mean, count = _contour_means(distance, near, evidence.samples.contours)
    claimed = (variance < options.doubt**2) & (cosine > evidence.facing)
    claimed &= 0.5 * distance**2 < options.unexplained * (1.0 + variance)
    claimed &= 0.5 * mean**2 < options.unexplained * (1.0 / count + variance)
    return claimed, evidence.misfit(distance)


def _contour_means(values, members, contours) -> tuple[np.ndarray, np.ndarray]:
    """Mean (m,) over those of two samples to either side on the contour that are members, and how
    many they are (m,)."""
    total, count = values.copy(), np.ones(len(values))
    for shift in (1, 2):
        near = (members[shift:] - members[:-shift] <= 2) & (
            contours[members[shift:]] == contours[members[:-shift]]
        )
        low, high = np.flatnonzero(near), np.flatnonzero(near) + shift
        total[low] += values[high]
        total[high] += values[low]
        count[low] += 1.0
        count[high] += 1.0
    return total / count, count
