"""Crossings: where contours run from one lawful piece over few samples to another, or lie on a ball
that touches both."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.rolling_ball import ball_chord, ball_radius
from touchatlas.atlas.edges.rounded_pair import RoundedPair
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.piece import Piece

# Longest chord between the two pieces, over the extent of the samples. Halved, wide fillets are
# faces of their own: a box with a rounding of 100 tolerances was 26 faces, and 18 tolerances off.
_WIDEST = 0.2
# Least number of samples of a contour in a row on each piece; so many beside the crossing must
# agree with a radius. Doubled, edges of narrow faces are left out.
_ROW = 3
# Least number of samples without a label, of those in a row, that lie on one ball. Doubled, edges
# that no contour crossed are unknown.
_LOOSE = 5
# Height over the other piece, in deviations, from which a sample beside a crossing shows its side,
# and the least excess of those on one side. Doubled, fewer samples tell, or none.
_HEIGHT, _ONE_SIDE = 3.0, 0.6

# Pairs of labels, the lower first, and spans of samples: the first one, and that after the last.
_Spans = dict[tuple[int, int], list[tuple[int, int]]]


@dataclass(frozen=True, eq=False)
class Crossings:
    """Crossings from one piece to another.

    Parameters
    ----------
    spans : (k, 2) int
        First sample between the pieces, and the first one beyond, of each.
    points : (k, 3) float, length
        Half-way between the last sample on one side and the first on the other.
    whole : (k,) bool
        Whether the contour runs on over both pieces; else it lies on a ball that touches both.
    """

    spans: np.ndarray
    points: np.ndarray
    whole: np.ndarray

    def __len__(self) -> int:
        return len(self.spans)

    @property
    def samples(self) -> np.ndarray:
        """(m,) samples between the pieces, ascending."""
        return _ranges(self.spans[:, 0], self.spans[:, 1])

    @property
    def beside(self) -> np.ndarray:
        """(m,) samples of both pieces next to those between them."""
        low, high = self.spans[self.whole].T
        return _ranges(np.append(low - _ROW, high), np.append(low, high + _ROW))

    def only(self, free) -> "Crossings":
        """Those between which all samples are ``free`` (n,)."""
        whole = np.array([bool(free[low:high].all()) for low, high in self.spans], bool)
        return Crossings(self.spans[whole], self.points[whole], self.whole[whole])

    def side(self, evidence: Evidence, first: Piece, second: Piece) -> float:
        """1 where most samples of each piece beside the crossings lie inside of the other, as at a
        convex edge; -1 where they lie outside, 0 otherwise. Where no contour runs on over both
        pieces, it is the samples on the ball that count."""
        own = self.beside if self.whole.any() else self.samples
        points = evidence.samples.points[own]
        inner = [piece.at(points)[0] for piece in (first, second)]
        heights = np.where(np.abs(inner[0]) > np.abs(inner[1]), *inner)
        sides = np.sign(heights[np.abs(heights) > _HEIGHT * evidence.samples.std])
        mean = float(sides.mean()) if len(sides) else 0.0
        return -float(np.sign(mean)) if abs(mean) > _ONE_SIDE else 0.0


def find_crossings(labels: Labels) -> dict[tuple[int, int], Crossings]:
    """Pairs of lawful labels, the lower first, mapped to the crossings between them."""
    bounds, lawful, widest = _rows(labels)
    over = _over(labels, bounds, lawful, widest)
    crossed = [low for spans in over.values() for low, _ in spans]
    on_balls = _on_balls(labels, bounds, widest, crossed)
    points = labels.evidence.samples.points
    return {
        pair: _crossings(points, over.get(pair, []), on_balls.get(pair, []))
        for pair in {**over, **on_balls}
    }


def longest_chord(evidence: Evidence) -> float:
    """Longest chord over the rounding of an edge, length."""
    return _WIDEST * evidence.samples.extent


def crossed_pairs(labels: Labels, free) -> set[tuple[int, int]]:
    """Pairs of lawful labels, the lower first, between which a contour runs over samples that are
    all ``free`` (n,), and over one at least."""
    found = _over(labels, *_rows(labels))
    points = labels.evidence.samples.points
    crossings = {pair: _crossings(points, spans, []) for pair, spans in found.items()}
    return {pair for pair, some in crossings.items() if len(some.only(free).samples)}


def _rows(labels: Labels) -> tuple[np.ndarray, np.ndarray, float]:
    """The first sample (r + 1,) of each row of samples of a contour with one label, and the end of
    the last; whether (r,) the label is lawful; and the longest chord of a crossing, length."""
    samples, of = labels.evidence.samples, labels.of
    change = (np.diff(of, prepend=-2) != 0) | (np.diff(samples.contours, prepend=-1) != 0)
    bounds = np.append(np.flatnonzero(change), len(of))
    lawful = [label != NONE and labels.pieces[label].kind.lawful for label in of[bounds[:-1]]]
    return bounds, np.array(lawful, bool), longest_chord(labels.evidence)


def _over(labels: Labels, bounds, lawful, widest: float) -> _Spans:
    """Pairs of labels, mapped to the spans (2,) between rows of them on one contour."""
    samples, of = labels.evidence.samples, labels.of
    wide = np.flatnonzero(lawful & (np.diff(bounds) >= _ROW))
    found: _Spans = {}
    for place, one in enumerate(wide.tolist()):
        last, seen = bounds[one + 1] - 1, set()
        for other in wide[place + 1 :].tolist():
            first = bounds[other]
            if samples.contours[first] != samples.contours[last] or of[first] == of[last]:
                # From the same label it is shorter.
                break
            if np.linalg.norm(samples.points[first] - samples.points[last]) > widest:
                break
            if of[first] not in seen:
                seen.add(of[first])
                pair = sorted((int(of[first]), int(of[last])))
                found.setdefault((pair[0], pair[1]), []).append((int(last) + 1, int(first)))
    return found


def runs_of(labels: Labels, label: int) -> Crossings:
    """The samples of a label as if contours ended on them: a span for each run on a contour."""
    members, contours = labels.members(label), labels.evidence.samples.contours
    new = (np.diff(members, prepend=-2) > 1) | (np.diff(contours[members], prepend=-1) != 0)
    ends = np.append(np.flatnonzero(new)[1:], len(members)) - 1
    spans = np.stack([members[new], members[ends] + 1], axis=1)
    return _crossings(labels.evidence.samples.points, [], spans)


def _on_balls(labels: Labels, bounds, widest: float, crossed) -> _Spans:
    """Pairs of labels, mapped to the spans (2,) of samples without a label that lie on a ball which
    touches both; but for those that begin where contours have ``crossed``."""
    samples, of = labels.evidence.samples, labels.of
    found: _Spans = {}
    low, high = bounds[:-1], bounds[1:]
    loose = (of[low] == NONE) & (high - low >= _LOOSE) & ~np.isin(low, crossed)
    low, high = low[loose], high[loose]
    around = _lawful_labels_near(labels, samples.points[(low + high) // 2], widest)
    for begin, end, near in zip(low.tolist(), high.tolist(), around, strict=True):
        if len(near) < 2:
            continue
        touched = partial(_touched, labels, near, np.arange(begin, end))
        depends = widest, begin, end, labels.pieces_of(near)
        pair, on = labels.evidence.recall.get(touched, "touched", *depends)
        if np.count_nonzero(on) >= _LOOSE:
            on_ball = begin + np.flatnonzero(on)
            two = near[pair[0]], near[pair[1]]
            found.setdefault(two, []).append((int(on_ball[0]), int(on_ball[-1]) + 1))
    return found


def _lawful_labels_near(labels: Labels, points, reach: float) -> list[list[int]]:
    """The lawful labels, ascending, that have samples within reach, length, of each of points
    (n, 3)."""
    out: list[list[int]] = [[] for _ in points]
    for label, members in enumerate(labels.all_members()):
        if labels.pieces[label].kind.lawful and len(points):
            tree = cKDTree(labels.evidence.samples.points[members])
            for place in np.flatnonzero(tree.query(points, distance_upper_bound=reach)[0] < np.inf):
                out[place].append(label)
    return out


def _touched(labels: Labels, near: list[int], run) -> tuple[tuple[int, int], np.ndarray]:
    """Which two of some labels, by their places, are touched by the ball on which most samples (m,)
    of a row lie, the lower first, and which (m,) do."""
    points, evidence = labels.evidence.samples.points[run], labels.evidence
    values = [labels.pieces[k].at(points) for k in near]
    distances, normals = (np.stack(column) for column in zip(*values, strict=True))
    pair, most = (0, 0), np.zeros(len(run), bool)
    for first, second, sign in _narrow(distances, normals, longest_chord(evidence)):
        both = RoundedPair(evidence, values[first], values[second], sign)
        found = both.radius() if both.is_edge else None
        if found is not None:
            on = both.ball_misfit(found[0]) < evidence.options.unexplained
            if np.count_nonzero(on) > np.count_nonzero(most):
                pair, most = (first, second), on
    return pair, most


def _narrow(distances, normals, widest: float) -> list[tuple[int, int, float]]:
    """Pairs of labels, the lower first, and signs of their edge, where the balls on which samples
    lie touch both no more than ``widest`` apart for some samples in a row: most labels are touched
    by balls as wide as the body alone. From distances (k, m) and normals (k, m, 3)."""
    first, second = np.triu_indices(len(distances), 1)
    cosine = (normals[first] * normals[second]).sum(axis=2)
    signs, counts = (1.0, -1.0), []
    for sign in signs:
        radius = ball_radius(sign * distances[first], sign * distances[second], cosine)
        counts.append(np.count_nonzero(ball_chord(radius, cosine) < widest, axis=1))
    which, side = np.nonzero(np.stack(counts, axis=1) >= _ROW)
    return [(int(first[k]), int(second[k]), signs[s]) for k, s in zip(which, side, strict=True)]


def _crossings(points, over, on_balls) -> Crossings:
    """Crossings of spans (2,) of both kinds."""
    whole = np.repeat([True, False], [len(over), len(on_balls)])
    spans = np.array([*over, *on_balls])
    low, high = spans[:, 0] - whole, spans[:, 1] - ~whole
    return Crossings(spans, 0.5 * (points[low] + points[high]), whole)


def _ranges(low, high) -> np.ndarray:
    """(m,) the whole numbers from each of ``low`` (k,) up to, but not with, each of ``high`` (k,),
    ascending and without repetition."""
    inside = np.zeros(max(high, default=0), bool)
    for a, b in zip(low, high, strict=True):
        inside[a:b] = True
    return np.flatnonzero(inside)
