"""Growing: the largest connected set of samples that one piece explains, from a small start."""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import LABEL_KINDS, Kind
from touchatlas.atlas.pieces.piece import Piece, in_plane_cosines

# Samples at which each kind starts: some more than parameters, from several contours. Doubled,
# starts lie across the rims of narrow faces.
_START = {
    Kind.PLANE: 14,
    Kind.SPHERE: 20,
    Kind.CYLINDER: 30,
    Kind.QUADRIC: 30,
    Kind.QUARTIC: 60,
}
# Most rounds of a fit and a claim. Doubled, nothing changes: growth doubles its extent in each.
_ROUNDS = 12
# Most samples that are fitted; a mean of 400 is within a twentieth of a deviation. Doubled, it
# takes a third more time.
_FITTED = 400
# Largest curvature of a flat piece times its length, over the angle by which it faces another way
# elsewhere: ten times as much would turn it by that angle evenly. Doubled, shallow domes with a
# sharp rim are two pieces.
_FLAT = 0.1
# Least such angle, rad: 30 degrees. Doubled, two planes at 45 degrees are one quadric.
_OTHER_WAY = np.deg2rad(30.0)
# Least cosine between normals and their mean where no two differ by that angle: of its half.
_ONE_WAY = np.cos(_OTHER_WAY / 2.0)
# Extent in which samples are claimed, over that of those claimed before. Doubled, more samples are
# evaluated in vain.
_REACH = 2.0
# Least cosine between the normals of a piece and of its samples, within the sampling planes: 37
# degrees. Doubled, it forbids claims beside edges, where normals are noisy.
_COSINE = 0.8
# Growth ends when this fraction of the samples is the same as before. Doubled (its distance from
# 1), growth ends one round earlier.
_SAME = 0.99
# Samples with which a piece is large enough that no kind of more parameters is tried. Doubled,
# twice as many are tried.
_ENOUGH = 300
# A piece is too bad for its samples when the mean square of their distances exceeds one by so many
# standard deviations of chi-square. Doubled, quartics are larger and err more.
_TOO_BAD = 4.0
# Samples more than parameters that a kind needs. Doubled, corners of few samples stay unexplained.
_SPARE = 4


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
    options : FaceOptions
    recall : Recall
        What was found of these samples before, by all that it depends on.
    """

    samples: ContourSamples
    graph: SampleGraph
    options: FaceOptions
    recall: Recall = field(default_factory=Recall)
    # A third of the fits are asked for again.
    _fits: dict[tuple[Kind, bytes], Piece | None] = field(default_factory=dict)

    def fit(self, kind: Kind, members) -> Piece | None:
        """The piece of a kind for samples, at most 400 of them, evenly along the contours."""
        s = evenly(members, _FITTED)
        key = kind, s.tobytes()
        if key not in self._fits:
            self._fits[key] = self._fit(kind, s)
        return self._fits[key]

    def _fit(self, kind: Kind, s) -> Piece | None:
        points = self.samples.points[s]
        piece = fit_piece(kind, points, self.samples.normals[s], self.samples.std)
        bends = kind in (Kind.QUADRIC, Kind.QUARTIC)
        if bends and piece is not None and is_edge(piece, points):
            return None
        return piece

    def compare(self, piece: Piece, members) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances over the deviation of a sample (m,), cosines of the normals (m,), and predicted
        variances over that of a sample (m,)."""
        samples = self.samples
        distance, normals, variance = piece.predicted(samples.points[members])
        cosines = in_plane_cosines(normals, samples.normals[members], samples.planes[members])
        return distance / samples.std, cosines, variance / samples.std**2

    def price(self, kind: Kind, count: int) -> float:
        """Nats for the parameters of a piece that explains ``count`` samples (Schwarz 1978)."""
        return 0.5 * kind.parameters * float(np.log(max(count, 2)))

    def misfit(self, distance) -> np.ndarray:
        """Nats for samples at such distances, in deviations, no more than unexplained ones."""
        return np.minimum(0.5 * distance**2, self.options.unexplained)

    def is_good(self, saved) -> bool:
        """Whether the samples that a piece explains are no farther off than chi-square allows, from
        the nats that it saves of each."""
        square = 2.0 * (self.options.unexplained - saved)
        return bool(square.mean() < 1.0 + _TOO_BAD * np.sqrt(2.0 / len(square)))

    def fitting_core(self, kind: Kind, members) -> np.ndarray:
        """The interior of the members, or all of them where it is too small to fit."""
        core = self.graph.interior(members)
        enough = max(2 * kind.parameters + _SPARE, len(members) // 2)
        return core if len(core) >= enough else members


def is_edge(piece: Piece, points) -> bool:
    """Whether a quadric or quartic is flat at most of its points (n, 3) and faces another way at
    some: then it is two planes and a rounded edge, as a hyperbola is, and no law of all three."""
    normals = piece.at(points)[1]
    mean = normals.mean(axis=0)
    if (normals @ mean).min() > _ONE_WAY * np.sqrt(mean @ mean):
        return False
    length = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    turn = length * piece.bends(points)
    flattest = normals[turn.argmin()]
    angle = float(np.arccos(np.clip((normals @ flattest).min(), -1.0, 1.0)))
    return bool(angle > _OTHER_WAY and np.median(turn) < _FLAT * angle)


def evenly(members, most: int) -> np.ndarray:
    """At most so many of the members, evenly spread in their order."""
    if len(members) <= most:
        return members
    return members[np.linspace(0, len(members) - 1, most).astype(int)]


def grow(evidence: Evidence, start, kind: Kind, allowed=None) -> Growth | None:
    """The best growth of one kind from starting samples.

    Parameters
    ----------
    evidence : Evidence
    start : (m,) int
        Samples, ascending.
    kind : Kind
    allowed : (n,) bool, optional
        Samples that may be claimed.
    """
    graph, points = evidence.graph, evidence.samples.points
    members, best = start, None
    for _ in range(_ROUNDS):
        core = evidence.fitting_core(kind, members)
        if len(core) < kind.parameters + _SPARE:
            break
        piece = evidence.fit(kind, core)
        if piece is None:
            break
        offset = points[members] - piece.origin
        reach = _REACH * float(np.sqrt((offset * offset).sum(axis=1).max()))
        near = np.array(graph.tree.query_ball_point(piece.origin, reach, return_sorted=True))
        if allowed is not None:
            near = near[allowed[near]]
        claimed, saved = _claims(evidence, piece, near)
        grown = graph.connected(near[claimed], members)
        if len(grown) < kind.parameters + _SPARE:
            break
        saved = saved[np.searchsorted(near, grown)]
        if not evidence.is_good(saved):
            break
        gain = float(saved.sum()) - evidence.price(kind, len(grown))
        if best is None or gain > best.gain:
            best = Growth(piece, grown, saved, gain)
        common = np.count_nonzero(graph.mask(members)[grown])
        if common >= _SAME * max(len(grown), len(members)):
            break
        members = grown
    return best


def _claims(evidence: Evidence, piece: Piece, near) -> tuple[np.ndarray, np.ndarray]:
    """Whether a piece may claim samples, (m,), and what it would save of each, nats (m,).

    Distances must be within the gate, alone and in the mean of five along the contour, and the
    predicted deviation must be small.
    """
    options = evidence.options
    distance, cosine, variance = evidence.compare(piece, near)
    distance = np.clip(distance, -20.0, 20.0)
    mean, count = _contour_means(distance, near, evidence.samples.contours)
    claimed = (variance < options.doubt**2) & (cosine > _COSINE)
    claimed &= np.abs(distance) < options.gate * np.sqrt(1.0 + variance)
    claimed &= np.abs(mean) < options.gate * np.sqrt(1.0 / count + variance)
    return claimed, options.unexplained - evidence.misfit(distance)


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


def grow_at(evidence: Evidence, seed: int, most: Kind = Kind.QUARTIC, allowed=None):
    """The best growth at a sample over the kinds up to ``most``, or None.

    A kind of more parameters also starts from what one of fewer explains, and must explain much
    more than it.
    """
    options, best = evidence.options, None
    for kind in LABEL_KINDS:
        if kind > most or (best is not None and _suffices(best, kind)):
            continue
        start = evidence.graph.nearest(evidence.samples.points, seed, _START[kind])
        if allowed is not None:
            start = start[allowed[start]]
        if best is not None and len(best.members) > len(start):
            start = best.members
        growth = grow(evidence, start, kind, allowed)
        if growth is None:
            continue
        leap = best is None or kind > Kind.CYLINDER or best.piece.kind is Kind.PLANE
        factor = options.better if leap else 1.0
        if best is None or growth.gain > factor * max(best.gain, 1.0):
            best = growth
    return best


def _suffices(best: Growth, kind: Kind) -> bool:
    """Whether a growth is so large that a kind of more parameters need not be tried."""
    if len(best.members) < _ENOUGH:
        return False
    return best.piece.kind is Kind.PLANE or (kind >= Kind.QUADRIC and best.piece.kind.lawful)
