"""Boundaries between the pieces of a labelling: sharp edge, smooth rim, or none but that one
polynomial ends."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.blunt_edges import BluntEdge, blunt_edges
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import (
    CurvePoints,
    angles,
    curvature_jump,
    gap,
    half_extent,
    intersection_points,
    mean_foot,
    rim_slope,
    valley_points,
)
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross, evenly

# Distance of samples from an edge that is sought between them, in steps.
_NEAR = 4.0
# Samples about a point of a boundary that say whose it is; points that a boundary needs.
_ABOUT, _LEAST = 8, 3


def find_boundaries(labels: Labels) -> list[Boundary]:
    """All boundaries between the pieces of a labelling, in order of their labels."""
    judge = _Judge(labels)
    blunt = {(edge.first, edge.second): edge for edge in blunt_edges(labels)}
    for edge in blunt.values():
        judge.rounded[edge.samples] = True
    links = _across_links(labels)
    found = {pair: judge.linked(*pair, middles) for pair, middles in links.items()}
    for pair, ends in _across_ends(labels, judge.trees, _NEAR * judge.step).items():
        if found.get(pair) is None:
            middles = np.concatenate([links[pair], ends]) if pair in links else ends
            found[pair] = judge.sharp(*pair, middles)
    for pair, edge in blunt.items():
        found[pair] = judge.blunt(edge, found.get(pair))
    return [boundary for _, boundary in sorted(found.items()) if boundary is not None]


class _Judge:
    """What lies between two pieces, from the samples of both."""

    def __init__(self, labels: Labels) -> None:
        self.labels, self.evidence = labels, labels.evidence
        self.members = labels.all_members()
        points = self.evidence.samples.points
        self.trees = [cKDTree(points[members]) for members in self.members]
        self.misfits = list(map(self._misfit, labels.pieces, self.members))
        self.step = float(np.median(self.evidence.samples.steps))
        # Samples that roundings of edges explain: they are of both pieces.
        self.rounded = np.zeros(len(labels.of), bool)

    def linked(self, a: int, b: int, points) -> Boundary | None:
        """The boundary of two pieces between whose samples there are links, with middles (m, 3)."""
        pieces, reach = (self.labels.pieces[a], self.labels.pieces[b]), _NEAR * self.step
        middles = mean_foot(*pieces, points)
        middles = middles[self._are_own(a, b, middles)]
        if len(middles) < _LEAST:
            return None
        at, deviation = middles, np.full(len(middles), self.step)
        angle = float(np.median(angles(*pieces, at)))
        across, jump = curvature_jump(*pieces, evenly(at, 16))
        # Normals that differ by more agree nowhere within reach.
        if angle <= 2.0 * jump * reach:
            valley = valley_points(*pieces, points, reach)
            own = self._are_own(a, b, valley.points)
            if np.count_nonzero(own) >= _LEAST:
                at, deviation = valley.points[own], valley.deviation[own]
                angle = float(np.median(angles(*pieces, at)))
                across, jump = curvature_jump(*pieces, evenly(at, 16))
        if angle > sum(self._slope_error(k, evenly(at, 16), across) for k in (a, b)):
            return self.sharp(a, b, points)
        lawful = all(piece.kind.lawful for piece in pieces)
        if lawful and self._are_apart(pieces, middles):
            return None
        # A plane, sphere or cylinder shows no change of its law; a torus beside a bent face may be
        # a part of it, as a quadric may.
        bends = all(piece.kind >= Kind.TORUS for piece in pieces)
        smooth = bends and self._one_holds(a, b, middles)
        kind = EdgeKind.ARTIFICIAL if smooth else EdgeKind.SMOOTH_RIM
        return Boundary(a, b, kind, CurvePoints(at, deviation), angle, gap(*pieces, middles))

    def blunt(self, edge: BluntEdge, before: Boundary | None) -> Boundary | None:
        """The boundary of two pieces about a blunt edge: the sharp edge that was rounded."""
        reach = self.step + edge.radius
        at = np.concatenate([edge.crossings, self.evidence.samples.points[edge.samples]])
        if before is not None:
            at = np.concatenate([at, before.curve.points])
        found = self.sharp(edge.first, edge.second, at, _NEAR * reach, blunt=True)
        return before if found is None else replace(found, blunt=edge)

    def sharp(
        self, a: int, b: int, points, reach: float | None = None, blunt: bool = False
    ) -> Boundary | None:
        """The sharp edge of two pieces about points (m, 3) between their samples, or None where
        they do not meet at an angle, or in fewer points. A ``blunt`` one lies away from the
        samples, so that samples about it may be of a third piece."""
        pieces = self.labels.pieces[a], self.labels.pieces[b]
        curve = intersection_points(*pieces, points, reach or _NEAR * self.step)
        own = self._are_own(a, b, curve.points, blunt)
        curve = CurvePoints(curve.points[own], curve.deviation[own])
        if len(curve.points) < (2 if blunt else _LEAST):
            return None
        angle = float(np.median(angles(*pieces, curve.points)))
        kind = self._kind(a, b, curve.points)
        return kind and Boundary(a, b, kind, curve, angle, gap(*pieces, curve.points))

    def _are_apart(self, pieces, middles) -> bool:
        """Whether two lawful pieces pass each other at points (m, 3), as parallel planes do."""
        (first, _, one), (second, _, other) = (piece.predicted(middles) for piece in pieces)
        deviation = np.sqrt(one + other + self.evidence.samples.std**2)
        return bool(np.median(np.abs(first - second) / deviation) > self.evidence.sure)

    def _are_own(self, a: int, b: int, points, blunt: bool = False) -> np.ndarray:
        """(m,) whether all samples about points (m, 3) are of two pieces or their rounding; about
        a ``blunt`` edge half of them, which may have no label: elsewhere the pieces meet beyond a
        third."""
        if not len(points):
            return np.zeros(0, bool)
        tree = self.evidence.graph.tree
        near = tree.query(points, k=min(_ABOUT, tree.n))[1].reshape(len(points), -1)
        of = self.labels.of[near]
        own = (of == a) | (of == b) | self.rounded[near] | (blunt & (of == NONE))
        return np.asarray(own.mean(axis=1) >= (0.5 if blunt else 1.0))

    def _slope_error(self, label: int, at, across) -> float:
        """Largest error of the slope of a piece at its rim, rad: that of the lack of fit that its
        samples do not show, by its extent across the rim."""
        piece, points = self.labels.pieces[label], self.trees[label].data
        half = half_extent(points, at, across, piece, 2.0 * self.step)
        return rim_slope(piece.kind, self.misfits[label], max(half, self.step))

    def _misfit(self, piece: Piece, members) -> float:
        """Lack of fit of a piece that its samples (m,) do not show, length."""
        square = 2.0 * float(self.evidence.nats(piece, members).mean())
        unseen = min(1.0, self.evidence.sure * np.sqrt(2.0 / len(members)))
        return float(np.sqrt(square * unseen) * np.median(self.evidence.samples.stds[members]))

    def _one_holds(self, a: int, b: int, middles) -> bool:
        """Whether one quartic explains the samples about a boundary as well as both pieces do."""
        points, tree = self.evidence.samples.points, cKDTree(middles)
        cost, about = 0.0, []
        for label in (a, b):
            members = self.members[label]
            near = members[tree.query(points[members])[0] < _NEAR * self.step]
            cost += float(self.evidence.nats(self.labels.pieces[label], near).sum())
            about.append(near)
        both = np.sort(np.concatenate(about))
        if len(both) < Kind.QUARTIC.parameters + 4:
            return True
        one = self.evidence.fit(Kind.QUARTIC, both)
        better = self.evidence.price(Kind.PLANE, len(both))
        return one is not None and bool(self.evidence.nats(one, both).sum() < cost + better)

    def _kind(self, a: int, b: int, at) -> EdgeKind | None:
        """Whether an edge at points (m, 3) is convex or concave: the near samples of each piece lie
        below the other, or above. None where they lie on both sides, so that a piece goes on."""
        sides = []
        for one, other in ((a, b), (b, a)):
            members, tree = self.members[other], self.trees[other]
            near = tree.query(at, k=min(_ABOUT, tree.n))[1].reshape(len(at), -1)
            std = self.evidence.samples.stds[members[near]]
            offset = tree.data[near] - at[:, None]
            normals = self.labels.pieces[one].at(at)[1]
            edge = cross(normals, self.labels.pieces[other].at(at)[1])[:, None]
            along = (offset * edge).sum(axis=2) ** 2
            square = (offset * offset).sum(axis=2) * (edge * edge).sum(axis=2)
            height = (offset * normals[:, None]).sum(axis=2)
            # Those along the edge may lie beyond its end.
            clear = np.abs(height) > self.evidence.sure * std
            far = height[(along < 0.25 * square) & clear]
            sides.append(float(np.sign(far).mean()) if len(far) else 0.0)
        if max(sides) < -self.evidence.facing:
            return EdgeKind.SHARP_CONVEX
        return EdgeKind.SHARP_CONCAVE if min(sides) > self.evidence.facing else None


def _across_links(labels: Labels) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to the middles (m, 3) of the links between their samples."""
    graph, points = labels.evidence.graph, labels.evidence.samples.points
    both = np.sort(labels.of[graph.pairs], axis=1)
    apart = np.flatnonzero((both[:, 0] != both[:, 1]) & (both[:, 0] != NONE))
    return _by_pair(both[apart], points[graph.pairs[apart]].mean(axis=1))


def _across_ends(
    labels: Labels, trees: list[cKDTree], reach: float
) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to the points (m, 3) half-way between an end of a contour of one and
    the nearest sample of the other, by the trees of the samples of each, within reach, length."""
    samples, of = labels.evidence.samples, labels.of
    new = np.diff(samples.contours, prepend=-1, append=samples.contours[-1] + 1) > 0
    ends = np.flatnonzero((new[:-1] | new[1:]) & (of != NONE))
    found = [np.zeros((2, 0), int)]
    for label, (members, tree) in enumerate(zip(labels.all_members(), trees, strict=True)):
        others = ends[of[ends] != label]
        _, nearest = tree.query(samples.points[others], distance_upper_bound=reach)
        there = nearest < len(members)
        found.append(np.stack([others[there], members[nearest[there]]]))
    i, j = np.concatenate(found, axis=1)
    both = np.sort(np.stack([of[i], of[j]], axis=1), axis=1)
    return _by_pair(both, 0.5 * (samples.points[i] + samples.points[j]))


def _by_pair(both, middles) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of labels, mapped to those of middles (m, 3) that are between labels ``both`` (m, 2),
    the lower first."""
    order = np.lexsort((both[:, 1], both[:, 0]))
    both, middles = both[order], middles[order]
    new = np.flatnonzero((np.diff(both, axis=0, prepend=-1) != 0).any(axis=1))
    parts = np.split(middles, new)[1:]
    return {(int(a), int(b)): part for (a, b), part in zip(both[new], parts, strict=True)}
