"""Blunt edges: two faces and one radius explain the samples of contours that run over an edge.

The rounding of an edge is often narrower than the distance of contours, so that pieces of its own
are many, uncertain, and end where contours do. One radius holds for the whole edge.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations

import numpy as np

from touchatlas.atlas.edges.crossings import Crossings, find_crossings, longest_chord
from touchatlas.atlas.edges.rolling_ball import ball_chord, rounded_corner
from touchatlas.atlas.edges.rounded_pair import RoundedPair
from touchatlas.atlas.labels.grow import evenly
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind

# Radius that is none, in its standard deviations: of 24 edges that are looked at after each of 40
# touches, 0.03 have a larger one by chance. Doubled, edges of one tolerance are sharp.
_SHARP = 4.0
# Nats that a blunt edge must save: odds of 400. Doubled, edges of one tolerance are sharp.
_BETTER = 6.0
# Samples of a label that are compared with an edge first. Doubled, it takes longer.
_FIRST = 60
# Links from samples to labels that may round them with a pair. Doubled, a body of many faces takes
# longer.
_LINKS = 6

# Distances (m,) and normals (m, 3) of a label at samples.
_Values = tuple[np.ndarray, np.ndarray]


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
    saved : float
        Nats that it saves.
    """

    first: int
    second: int
    sign: float
    radius: float
    deviation: float
    samples: np.ndarray
    crossings: np.ndarray
    saved: float


class Rounding:
    """What edges that are rounded say of the samples of a labelling.

    Parameters
    ----------
    labels : Labels
    """

    def __init__(self, labels: Labels) -> None:
        self.labels, self.evidence = labels, labels.evidence
        self.crossings = dict(sorted(find_crossings(labels).items()))

    @cached_property
    def edges(self) -> list[BluntEdge]:
        """The edges whose radius differs from zero, in order of their labels."""
        found = [self.edge(*pair, some) for pair, some in self.crossings.items()]
        return [edge for edge in found if edge is not None]

    def edge(self, first: int, second: int, crossings: Crossings, given=()) -> BluntEdge | None:
        """The rounded edge of two labels, or None where none is shorter to describe.

        Only those crossings count between which no sample has another label, but labels that are
        ``given`` up. Where none is, the radius differs from zero.
        """
        labels, pair, given = self.labels, (first, second), sorted(given)
        crossings = crossings.only(np.isin(labels.of, [NONE, *pair, *given]))
        if not len(crossings):
            return None
        members = np.flatnonzero(np.isin(labels.of, given))
        samples = np.unique(np.concatenate([crossings.samples, crossings.beside, members]))
        thirds = self._thirds(pair, given, samples)
        own, which = np.unique(labels.of[samples], return_inverse=True)
        arrays = crossings.spans, crossings.whole, samples, which
        pieces = (labels.pieces_of(some) for some in (pair, given, thirds, own.tolist()))
        recall, depends = self.evidence.recall, (*pieces, *arrays)
        ball = recall.get(partial(self._ball, pair, crossings, given, samples), "ball", *depends)
        # Balls as wide as the body touch most of its faces.
        if ball is None or ball[3] > longest_chord(self.evidence):
            return None
        sign, radius, deviation, _ = ball
        saves = partial(self._saved, pair, sign, radius, crossings, given, thirds, samples)
        saved = recall.get(saves, "edge", *depends)
        if saved is None:
            return None
        on = self._on_ball(pair, sign, radius)
        return BluntEdge(first, second, sign, radius, deviation, on, crossings.points, saved)

    def _ball(
        self, pair, crossings: Crossings, given, samples
    ) -> tuple[float, float, float, float] | None:
        """Sign, radius, its deviation, and median chord of the ball that rounds the edge of two
        labels, from the samples (m,) of its crossings and of labels that are given up; None where
        there is none."""
        sign = crossings.side(self.evidence, *(self.labels.pieces[k] for k in pair))
        across = self._pair(pair, sign, samples)
        if sign == 0.0 or not across.is_edge:
            return None
        found = across.radius()
        if found is None or not (len(given) or found[0] > _SHARP * found[1]):
            return None
        return sign, *found, float(np.median(ball_chord(found[0], across.cosine)))

    def _saved(
        self, pair, sign: float, radius: float, crossings: Crossings, given, thirds, samples
    ) -> float | None:
        """Nats that the rounded edge of two labels saves; None where it is no shorter."""
        labels, across = self.labels, self._pair(pair, sign, samples)
        # A sample whose normal no piece shares may lie at a sharp edge.
        sharp = np.where(labels.of[samples] == NONE, across.misfit(0.0), np.inf)
        members = np.isin(labels.of[samples], given)
        crossing = ~members | np.isin(samples, crossings.samples)
        # Most labels between are faces: a few of their samples show it.
        some = evenly(samples[crossing], _FIRST)
        if not self._are_near(self._after(pair, sign, radius, some, thirds)):
            return None
        after = self._after(pair, sign, radius, samples, thirds)
        saved = (np.minimum(self._now(samples), sharp) - after).sum()
        saved -= 0.5 * np.log(len(samples)) - sum(self._price(k) for k in given)
        near = self._are_near(after[crossing])
        if saved <= _BETTER or not near or self._is_bevel(samples, after):
            return None
        return float(saved)

    def _are_near(self, nats) -> bool:
        """Whether samples of so many nats (m,) are no farther off than chi-square allows."""
        return self.evidence.is_good(self.evidence.options.unexplained - nats)

    def _is_bevel(self, samples, after) -> bool:
        """Whether a plane explains those samples (m,) that have no label for less than a rounded
        edge does, nats (m,). They remain without one, until more of them show the plane."""
        loose = self.labels.of[samples] == NONE
        between, evidence = samples[loose], self.evidence
        piece = evidence.fit(Kind.PLANE, between) if len(between) > Kind.PLANE.parameters else None
        if piece is None:
            return False
        flat = evidence.misfit(evidence.compare(piece, between)[0]).sum()
        flat += evidence.price(Kind.PLANE, len(between)) + _BETTER
        return bool(flat < after[loose].sum())

    def _after(self, pair, sign: float, radius: float, samples, thirds) -> np.ndarray:
        """(m,) nats of samples by a rounded edge of two labels, and by the roundings at its ends:
        the edges and corners that these have with third labels, with the same radius."""
        values = [self._values(k, samples) for k in (*pair, *thirds)]
        out = RoundedPair(self.evidence, values[0], values[1], sign).misfit(radius)
        distances = sign * np.stack([distance for distance, _ in values])
        normals = np.stack([normal for _, normal in values])
        # A sample on a ball is not outside of the pieces that the ball touches.
        most = np.sqrt(2.0 * self.evidence.options.unexplained) * self.evidence.samples.std
        near = (distances > -radius) & (distances < min(radius, most))
        labels, rows = _together(near, 2)
        first, second = ((distances[k, rows], normals[k, rows]) for k in labels.T)
        nats = RoundedPair(self.evidence, first, second, 1.0).ball_misfit(radius)
        np.minimum.at(out, rows, nats)
        labels, rows = _together(near, 3)
        three = labels, rows[:, None]
        found, _, ball = rounded_corner(
            distances[three], normals[three], np.full(len(rows), radius)
        )
        nats = self.evidence.misfit(found / self.evidence.samples.std)
        np.minimum.at(out, rows[ball], nats[ball])
        return out

    def saved_by(self, edge: BluntEdge, label: int) -> float:
        """Nats that are saved where all samples of a label are given to a rounded edge; minus
        infinity where some of them alone cost more than all do now."""
        members, pair = self.labels.members(label), (edge.first, edge.second)
        now = self._now(members).sum() + self._price(label)
        thirds = self._thirds(pair, {label}, members)
        first = [evenly(members, _FIRST)] if len(members) > _FIRST else []
        for some in (*first, members):
            after = self._after(pair, edge.sign, edge.radius, some, thirds).sum()
            if after >= now:
                return -np.inf
        return float(now - after)

    def give(self, edge: BluntEdge, label: int) -> None:
        """Give the samples of a label to the pieces of a rounded edge, and to none those on its
        rounding or far from all."""
        members, far = self.labels.members(label), self.evidence.options.unexplained
        pair = self._pair((edge.first, edge.second), edge.sign, members)
        weights = pair.at(edge.radius)[1]
        loose = (weights.min(axis=1) > 0.0) | (pair.misfit(edge.radius) >= far)
        side = np.where(weights[:, 0] > 0.0, edge.first, edge.second)
        self.labels.of[members] = np.where(loose, NONE, side)

    def _values(self, label: int, samples) -> _Values:
        """Distances (m,) and normals (m, 3) of a label at samples (m,)."""
        return self.labels.pieces[label].at(self.evidence.samples.points[samples])

    def _pair(self, pair, sign: float, samples) -> RoundedPair:
        first, second = (self._values(k, samples) for k in pair)
        return RoundedPair(self.evidence, first, second, sign)

    def _on_ball(self, pair, sign: float, radius: float) -> np.ndarray:
        """(m,) samples without a label that lie on the rounding of an edge."""
        loose = np.flatnonzero(self.labels.of == NONE)
        across = self._pair(pair, sign, loose)
        return loose[across.ball_misfit(radius) < self.evidence.options.unexplained]

    def _now(self, samples) -> np.ndarray:
        """(m,) nats of samples by their own labels, or by none."""
        of = self.labels.of[samples]
        out = np.full(len(samples), self.evidence.options.unexplained)
        for label in np.unique(of[of != NONE]).tolist():
            mine = of == label
            distance = self.evidence.compare(self.labels.pieces[label], samples[mine])[0]
            out[mine] = self.evidence.misfit(distance)
        return out

    def _price(self, label: int) -> float:
        """Nats for the parameters of a label."""
        kind, count = self.labels.pieces[label].kind, len(self.labels.members(label))
        return self.evidence.price(kind, count)

    def _thirds(self, pair, given, samples) -> list[int]:
        """The labels about samples (m,), none of those ``given`` up, to which contours run from one
        of a pair."""
        around = np.unique(self.labels.of[self.labels.graph.around(samples, _LINKS)]).tolist()
        ends = [k for k in around if k not in (NONE, *pair, *given)]
        return [k for k in ends if any((min(k, p), max(k, p)) in self.crossings for p in pair)]


def _together(near, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Labels (k, count) and samples (k,), for each sample all sets of labels that are ``near`` it
    (labels, m)."""
    some = list(combinations(np.flatnonzero(near.any(axis=1)).tolist(), count))
    together = np.array(some, int).reshape(-1, count)
    which, samples = np.nonzero(near[together].all(axis=1))
    return together[which], samples
