"""Blunt edges: two faces and one radius explain the samples of contours that run over an edge.

The rounding of an edge is often narrower than the distance of contours, so that pieces of its own
are many, uncertain, and end where contours do. One radius holds for the whole edge.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.rolling_ball import ball_chord, rounded_corner
from touchatlas.atlas.edges.rounded_pair import PiecesAt, RoundedPair
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind

# Longest chord over a rounding, over the extent of the samples: wider ones are faces of their own.
_WIDEST = 0.2
# Samples of a contour in a row on a piece; so many beside a crossing must agree with a radius.
_ROW = 3


@dataclass(frozen=True, eq=False)
class BluntEdge:
    """An edge of two pieces that is rounded with one radius.

    Parameters
    ----------
    first, second : int
        Labels, the lower first.
    sign : float
        1 for a convex edge, -1 for a concave one.
    radius, deviation : float, length
        The radius and its standard deviation.
    samples : (m,) int
        Those without a label that it explains, ascending.
    crossings : (k, 3) float, length
        A point beside the edge for each contour that runs over it.
    """

    first: int
    second: int
    sign: float
    radius: float
    deviation: float
    samples: np.ndarray
    crossings: np.ndarray


@dataclass(frozen=True, eq=False)
class Crossings:
    """The places where contours run from one label over few samples to another: spans (k, 2) of the
    first sample between and the first one beyond, and points (k, 3) half-way, length."""

    spans: np.ndarray
    points: np.ndarray

    @property
    def samples(self) -> np.ndarray:
        """(m,) samples between the labels, ascending."""
        return _ranges(*self.spans.T)

    @property
    def beside(self) -> np.ndarray:
        """(m,) samples of both labels next to those between them."""
        low, high = self.spans.T
        return _ranges(np.append(low - _ROW, high), np.append(low, high + _ROW))

    def only(self, free) -> "Crossings":
        """Those between which all samples are ``free`` (n,)."""
        whole = np.array([bool(free[low:high].all()) for low, high in self.spans], bool)
        return Crossings(self.spans[whole], self.points[whole])


def find_crossings(labels: Labels) -> dict[tuple[int, int], Crossings]:
    """Pairs of lawful labels, the lower first, mapped to the crossings between them."""
    samples, of = labels.evidence.samples, labels.of
    change = (np.diff(of, prepend=-2) != 0) | (np.diff(samples.contours, prepend=-1) != 0)
    bounds = np.append(np.flatnonzero(change), len(of))
    lawful = np.array([k != NONE and labels.pieces[k].kind.lawful for k in of[bounds[:-1]]], bool)
    rows = np.flatnonzero(lawful & (np.diff(bounds) >= _ROW))
    found: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for place, one in enumerate(rows.tolist()):
        last, seen = bounds[one + 1] - 1, set()
        for first in bounds[rows[place + 1 :]].tolist():
            way = samples.points[first] - samples.points[last]
            other_contour = samples.contours[first] != samples.contours[last]
            # From a later row of the same label it is shorter.
            if other_contour or of[first] == of[last] or way @ way > _widest(labels) ** 2:
                break
            if of[first] not in seen:
                seen.add(of[first])
                low, high = sorted((int(of[first]), int(of[last])))
                found.setdefault((low, high), []).append((int(last) + 1, int(first)))
    ends = {pair: np.array(own) - [1, 0] for pair, own in sorted(found.items())}
    return {pair: Crossings(k + [1, 0], samples.points[k].mean(axis=1)) for pair, k in ends.items()}


def blunt_edges(labels: Labels) -> list[BluntEdge]:
    """The edges whose radius differs from zero, in order of their labels."""
    depends = labels.of, tuple(labels.pieces)
    return labels.evidence.recall.get(lambda: _blunt_edges(labels), "blunt edges", *depends)


def _blunt_edges(labels: Labels) -> list[BluntEdge]:
    """The same, where they are not known of the same labels."""
    found = [blunt_edge(labels, pair, some) for pair, some in find_crossings(labels).items()]
    crossed = [edge for edge in found if edge is not None]
    edges = [*crossed, *_uncrossed_edges(labels, crossed)]
    return sorted(edges, key=lambda edge: (edge.first, edge.second))


def _uncrossed_edges(labels: Labels, crossed: list[BluntEdge]) -> Iterator[BluntEdge]:
    """Rounded edges over which no contour runs across: samples without a label lie on the ball that
    rounds the edges of both faces with a third one."""
    of, tried = labels.of.copy(), {(edge.first, edge.second) for edge in crossed}
    for edge in crossed:
        # Samples on known roundings show no others.
        of[edge.samples] = len(labels.pieces)
    loose = np.flatnonzero(of == NONE)
    for one, two in combinations(crossed, 2):
        own = sorted({one.first, one.second} ^ {two.first, two.second})
        if len(own) != 2 or one.sign != two.sign or (own[0], own[1]) in tried:
            continue
        pair, radius = (own[0], own[1]), 0.5 * (one.radius + two.radius)
        tried.add(pair)
        uncrossed = _uncrossed_edge(labels, pair, one.sign, radius, loose)
        if uncrossed is not None:
            yield uncrossed


def _uncrossed_edge(
    labels: Labels, pair: tuple[int, int], sign: float, radius: float, loose
) -> BluntEdge | None:
    """The edge of two labels by samples (m,) without a label on a ball of a radius; None where too
    few lie on one."""
    evidence, samples = labels.evidence, labels.evidence.samples
    for label in pair:
        away = cKDTree(samples.points[labels.members(label)]).query(samples.points[loose])[0]
        loose = loose[away < _widest(labels)]
    on_ball = RoundedPair(PiecesAt(labels, loose), pair, sign).ball_nats(radius)
    members = loose[on_ball < evidence.options.unexplained]
    if len(members) < 2 * _ROW:
        return None
    across = RoundedPair(PiecesAt(labels, members), pair, sign)
    found = across.radius()
    if found is None or not abs(found[0] - radius) < evidence.sure * found[1]:
        return None
    nats = across.ball_nats(found[0])
    saved = evidence.options.unexplained * len(members) - nats.sum() - 0.5 * np.log(len(members))
    if not evidence.is_good(nats) or saved <= 0.5 * evidence.sure**2:
        return None
    first = np.unique(samples.contours[members], return_index=True)[1]
    points = samples.points[members[first]]
    return BluntEdge(*pair, sign, *found, samples=members, crossings=points)


def needless_labels(labels: Labels) -> Iterator[tuple[BluntEdge, int]]:
    """Rounded edges, and a label that each may make needless: one between its faces, from whose
    samples its radius is known, too, or one beside it."""
    linked = labels.pairs()
    for pair, some in find_crossings(labels).items():
        for label in _unsettled(labels, pair, labels.of[some.samples]):
            edge = blunt_edge(labels, pair, some, (label,))
            if edge is not None:
                yield edge, label
        edge = blunt_edge(labels, pair, some)
        if edge is not None:
            around = labels.of[labels.evidence.graph.around(edge.samples, 1)]
            beside = [k for two in linked if set(two) & set(pair) for k in two]
            for label in _unsettled(labels, pair, np.append(around, beside)):
                yield edge, label


def _unsettled(labels: Labels, pair: tuple[int, int], some) -> list[int]:
    """Those of ``some`` labels (k,), ascending, that were not offered to the edge of a pair when
    all three had nearly the samples that they have."""
    names = sorted(set(some.tolist()) - {NONE, *pair})
    own = [labels.members(k) for k in pair]
    return [k for k in names if not labels.given.has(labels.members(k), *own)]


def rounding_nats(edge: BluntEdge, at: PiecesAt, given=()) -> np.ndarray:
    """(m,) nats of samples by the ball of an edge, and where it goes on at its ends: by the edges
    of its faces with a third one, not ``given`` up, and by the corner of all three."""
    labels, evidence, pair = at.labels, at.labels.evidence, (edge.first, edge.second)
    around = labels.of[evidence.graph.around(np.union1d(at.samples, edge.samples), 6)]
    thirds = set(around.tolist()) - {NONE, *pair, *given}
    nats = RoundedPair(at, pair, edge.sign).ball_nats(edge.radius)
    for third in sorted(k for k in thirds if labels.pieces[k].kind.lawful):
        for one in pair:
            along = RoundedPair(at, (one, third), edge.sign)
            nats = np.minimum(nats, along.ball_nats(edge.radius))
        nats = np.minimum(nats, _corner_nats(at, (*pair, third), edge))
    return nats


def _corner_nats(at: PiecesAt, faces: tuple[int, int, int], edge: BluntEdge) -> np.ndarray:
    """(m,) nats of samples by the ball that touches three faces and has the radius of an edge;
    beside it those of unexplained samples.

    An offset from the centre is no shorter than its parts along the normals. So most samples are
    seen to be off the ball by their distances from the faces.
    """
    evidence, most = at.labels.evidence, at.labels.evidence.options.unexplained
    distances = edge.sign * np.stack([at[k][0] for k in faces], axis=1)
    least = np.abs(distances + edge.radius).max(axis=1) - edge.radius
    near = np.flatnonzero(evidence.misfit(np.maximum(least, 0.0) / at.std) < most)
    normals = np.stack([at[k][1][near] for k in faces], axis=1)
    off, _, ball = rounded_corner(distances[near], normals, np.full(len(near), edge.radius))
    nats = np.full(len(at.samples), most)
    nats[near] = np.where(ball, evidence.misfit(off / at.std[near]), most)
    return nats


def blunt_edge(
    labels: Labels, pair: tuple[int, int], crossings: Crossings, given=()
) -> BluntEdge | None:
    """The rounded edge of two labels, or None where a sharp edge or a bevel is shorter. Only those
    crossings count between which no sample has another label, but those ``given`` up."""
    crossings = crossings.only(np.isin(labels.of, [NONE, *pair, *given]))
    if not len(crossings.spans):
        return None
    evidence, members = labels.evidence, np.flatnonzero(np.isin(labels.of, [*given]))
    samples = np.unique(np.concatenate([crossings.samples, crossings.beside, members]))
    own = labels.of[samples]
    sides = np.select([own == pair[0], own == pair[1], own == NONE], [0, 1, NONE], 2)
    depends = tuple(labels.pieces[k] for k in pair), samples, sides, crossings.spans
    found = evidence.recall.get(
        lambda: _rounding(labels, pair, samples, crossings), "rounding", *depends
    )
    if found is None or found.chord > _widest(labels):
        return None
    loose = np.flatnonzero(np.isin(labels.of, [NONE, *given]))
    on_ball = RoundedPair(PiecesAt(labels, loose), pair, found.sign).ball_nats(found.radius)
    on_ball = loose[on_ball < evidence.options.unexplained]
    own = pair[0], pair[1], found.sign, found.radius, found.deviation
    return BluntEdge(*own, on_ball, crossings.points)


@dataclass(frozen=True)
class _Rounding:
    """The sign of an edge, the radius of its rounding, the deviation of that, and the chord over
    it, length."""

    sign: float
    radius: float
    deviation: float
    chord: float


def _rounding(labels: Labels, pair, samples, crossings: Crossings) -> _Rounding | None:
    """What samples (m,) at the crossings of two labels say of a rounding; None where a sharp edge
    or a bevel is shorter."""
    evidence, sign = labels.evidence, _sign(labels, pair, crossings.beside)
    across = RoundedPair(PiecesAt(labels, samples), pair, sign)
    found = across.radius() if sign else None
    if found is None or not found[0] > evidence.sure * found[1]:
        return None
    nats = across.nats(found[0])
    low, high = np.searchsorted(samples, crossings.spans.T + [[-_ROW], [_ROW]])
    good = [evidence.is_good(nats[a:b]) for a, b in zip(low, high, strict=True)]
    saved = float((across.nats(0.0) - nats).sum()) - 0.5 * float(np.log(len(samples)))
    # Contours over a corner leave the edge.
    if np.mean(good) < 0.5 or saved <= 0.5 * evidence.sure**2:
        return None
    loose = labels.of[samples] == NONE
    if _is_bevel(evidence, samples[loose], float(nats[loose].sum())):
        return None
    return _Rounding(sign, *found, chord=float(np.median(ball_chord(found[0], across.cosine))))


def _sign(labels: Labels, pair, samples) -> float:
    """1 where most samples (m,) of each label lie inside of the other's piece, as beside a convex
    edge; -1 where they lie outside, 0 otherwise."""
    evidence = labels.evidence
    points, of = evidence.samples.points[samples], labels.of[samples]
    heights = np.where(of == pair[0], *(labels.pieces[k].at(points)[0] for k in pair[::-1]))
    clear = np.abs(heights) > evidence.sure * evidence.samples.stds[samples]
    sides = np.sign(heights[clear])
    mean = float(sides.mean()) if len(sides) else 0.0
    return -float(np.sign(mean)) if abs(mean) > evidence.facing else 0.0


def _is_bevel(evidence: Evidence, samples, nats: float) -> bool:
    """Whether a plane explains samples (m,) without a label for less than a rounded edge does."""
    piece = evidence.fit(Kind.PLANE, samples) if len(samples) > Kind.PLANE.parameters else None
    if piece is None:
        return False
    flat = evidence.nats(piece, samples).sum() + evidence.price(Kind.PLANE, len(samples))
    return bool(flat < nats)


def _widest(labels: Labels) -> float:
    """Longest chord over the rounding of an edge, length."""
    return _WIDEST * labels.evidence.samples.extent


def _ranges(low, high) -> np.ndarray:
    """(m,) the whole numbers from each of ``low`` (k,) up to, but not with, each of ``high`` (k,),
    ascending and without repetition."""
    inside = np.zeros(max(high, default=0), bool)
    for a, b in zip(low, high, strict=True):
        inside[a:b] = True
    return np.flatnonzero(inside)
