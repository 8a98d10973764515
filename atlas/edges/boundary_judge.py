"""BoundaryJudge: sharp edge, smooth rim, or none but that one polynomial ends."""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.blunt_edges import BluntEdge
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import (
    CurvePoints,
    angles,
    curvature_jump,
    gap,
    half_extent,
    intersection_points,
    largest_curvature,
    mean_foot,
    valley_points,
)
from touchatlas.atlas.edges.misfit import rim_errors, unseen_misfit
from touchatlas.atlas.labels.grow import evenly
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.patch.geometry.arrays import cross

# Distance of samples of two pieces between which an edge is sought although no contour crosses it,
# in steps. Doubled, edges are found between fewer touches, and some beyond a third face.
NEAR = 4.0
# Samples about a boundary that one quartic must explain if nothing else is there: within so many
# steps of it. Doubled, quartics fail on smooth surfaces too.
_WINDOW = 4.0
# Nats by which two pieces must explain them better: odds of 400. Doubled, slight rims are missed.
_BETTER = 6.0
# Samples about a boundary that are too few to say that one quartic does not explain them. Doubled,
# rims of narrow faces are missed.
_FEW = 25
# Samples of a piece beside a point of an edge, and the least excess of those on one side of the
# other piece. Doubled, they lie where the pieces bend apart.
_BESIDE, _ONE_SIDE = 8, 0.6
# Boundary points at which the extent of a piece is measured. Doubled, it takes twice as long.
_MEASURED = 16
# Largest angle of two pieces whose normals are sought to agree, over the jump of their curvatures
# times the search distance. Doubled, it takes longer.
_FARTHER = 2.0
# Points that a sharp edge needs. Doubled, short edges are missed.
LEAST_POINTS = 3
# Points that a rounded edge needs: at one a bevel passes for a rounding. Doubled, short edges are
# missed.
_LEAST_BLUNT = 2
# Samples about a point of a boundary, and the least fraction that is of the two pieces. Doubled,
# boundaries end farther from corners.
_ABOUT, _MOST = 8, 1.0
# The same fraction about the sharp edge that a ball rounds. Doubled, short wide roundings beside
# other faces are sharp; at 0 a contour on a fillet of a part with 80 faces was a rounding.
_MOST_BLUNT = 0.5
# Largest jump of the curvature between a lawful piece and one that may continue it smoothly, over
# the larger curvature: a law shows no change of it. Doubled, a fillet continues a flat face.
_LAWFUL_JUMP = 0.5
# Distance of two lawful pieces that do not meet, in standard deviations of it and of a sample: the
# ends of a piece err more than is predicted. Doubled, steps of ten deviations are bridged.
_APART = 5.0
# Least angle of a sharp edge that no contour crosses, rad: contours run on over blunter ones.
# Doubled, edges of 20 degrees between contours that end there are missed.
_UNCROSSED = np.deg2rad(10.0)


class BoundaryJudge:
    """What lies between two pieces, from the samples of both."""

    def __init__(self, labels: Labels) -> None:
        self.labels, self.evidence = labels, labels.evidence
        self.members = labels.all_members()
        pairs = zip(labels.pieces, self.members, strict=True)
        self.misfits = [unseen_misfit(self.evidence, p, m) if len(m) else 0.0 for p, m in pairs]
        self.step = float(np.median(self.evidence.samples.steps))
        # Samples that roundings of edges explain: they are of both pieces.
        self.rounded = np.zeros(len(labels.of), bool)

    def between(self, a: int, b: int, points) -> Boundary | None:
        """The boundary of two pieces with links, as it was found before where nothing changed."""
        pieces, members = self.labels.pieces, self.members
        depends = a, b, pieces[a], pieces[b], members[a], members[b], points, self.rounded
        linked = partial(self.linked, a, b, points)
        found: Boundary | None = self.evidence.recall.get(linked, "boundary", *depends)
        return found

    def linked(self, a: int, b: int, points) -> Boundary | None:
        """The boundary of two pieces between whose samples there are links, with middles (m, 3)."""
        pieces, reach = (self.labels.pieces[a], self.labels.pieces[b]), NEAR * self.step
        middles = mean_foot(*pieces, points)
        middles = self._own(a, b, CurvePoints(middles, np.full(len(middles), self.step))).points
        if len(middles) < LEAST_POINTS:
            return None
        at, valley = middles, CurvePoints(middles[:0], np.zeros(0))
        angle = float(np.median(angles(*pieces, at)))
        across, jump = curvature_jump(*pieces, evenly(at, _MEASURED))
        # Normals that differ by more agree nowhere within reach.
        if angle <= _FARTHER * jump * reach:
            valley = self._own(a, b, valley_points(*pieces, points, reach))
        if len(valley.points) >= LEAST_POINTS:
            at = valley.points
            angle = float(np.median(angles(*pieces, at)))
            across, jump = curvature_jump(*pieces, evenly(at, _MEASURED))
        errors = [self._rim_errors(k, evenly(at, _MEASURED), across) for k in (a, b)]
        slope, curvature = np.sum(errors, axis=0)
        if angle > slope:
            return self.uncrossed(a, b, points, slope)
        if any(piece.kind.lawful for piece in pieces):
            curvature = min(curvature, _LAWFUL_JUMP * largest_curvature(*pieces, at))
        if self._are_apart(pieces, middles):
            return None
        smooth = jump <= curvature and self._one_holds(a, b, middles)
        kind = EdgeKind.ARTIFICIAL if smooth else EdgeKind.SMOOTH_RIM
        if smooth or len(valley.points) < LEAST_POINTS:
            valley = CurvePoints(middles, np.full(len(middles), self.step))
        return Boundary(a, b, kind, valley, angle, gap(*pieces, middles))

    def blunt(self, edge: BluntEdge, before: Boundary | None) -> Boundary | None:
        """The boundary of two pieces about a blunt edge: the sharp edge that was rounded."""
        pair = edge.first, edge.second
        pieces = self.labels.pieces[edge.first], self.labels.pieces[edge.second]
        reach = NEAR * self.step + NEAR * edge.radius
        crossings = CurvePoints(edge.crossings, np.zeros(len(edge.crossings)))
        beside = self._own(*pair, crossings, loose=True)
        at = intersection_points(*pieces, beside.points, reach).points
        if before is not None:
            at = np.concatenate([at, before.curve.points])
        found = self.uncrossed(*pair, at, points=_LEAST_BLUNT, blunt=True)
        return before if found is None else replace(found, blunt=edge)

    def uncrossed(
        self,
        a: int,
        b: int,
        middles,
        least: float = _UNCROSSED,
        points: int = LEAST_POINTS,
        blunt: bool = False,
    ) -> Boundary | None:
        """The sharp edge of two pieces about points between their samples, or None where they do
        not meet at an angle, or in fewer points. A ``blunt`` one lies away from the samples, so
        that up to half of those about it may be of a third piece."""
        pieces = self.labels.pieces[a], self.labels.pieces[b]
        curve = intersection_points(*pieces, middles, NEAR * self.step)
        curve = self._own(a, b, curve, blunt, _MOST_BLUNT if blunt else _MOST)
        if len(curve.points) < points:
            return None
        angle = float(np.median(angles(*pieces, curve.points)))
        kind = self._sides(a, b, curve.points)
        if angle <= least or kind is None:
            return None
        return Boundary(a, b, kind, curve, angle, gap(*pieces, curve.points))

    def between_corners(self, a: int, b: int, corners) -> Boundary | None:
        """The sharp edge of two pieces between corners (m, 3), or None where a piece goes on."""
        pieces = self.labels.pieces[a], self.labels.pieces[b]
        curve = intersection_points(*pieces, corners, self.step)
        kind = self._sides(a, b, curve.points) if len(curve.points) else None
        if kind is None:
            return None
        angle = float(np.median(angles(*pieces, curve.points)))
        return Boundary(a, b, kind, curve, angle, gap(*pieces, curve.points))

    def _are_apart(self, pieces, middles) -> bool:
        """Whether two lawful pieces pass each other at points (m, 3), as parallel planes do."""
        if not all(piece.kind.lawful for piece in pieces):
            return False
        (first, _, one), (second, _, other) = (piece.predicted(middles) for piece in pieces)
        limit = _APART * np.sqrt(one + other + self.evidence.samples.std**2)
        return bool(np.median(np.abs(first - second) / limit) > 1.0)

    def _own(
        self, a: int, b: int, curve: CurvePoints, loose: bool = False, most: float = _MOST
    ) -> CurvePoints:
        """The points of a curve about which a fraction ``most`` of the samples or more is of the
        two pieces, or ``loose``: elsewhere these meet beyond a third. On a short blunt edge most
        samples may lie on corners, which are explained later."""
        if not len(curve.points):
            return curve
        tree = self.evidence.graph.tree
        _, near = tree.query(curve.points, k=min(_ABOUT, tree.n))
        of = self.labels.of[near.reshape(len(curve.points), -1)]
        others = self.rounded[near.reshape(len(curve.points), -1)] | loose & (of == NONE)
        own = ((of == a) | (of == b) | others).mean(axis=1) >= most
        return CurvePoints(curve.points[own], curve.deviation[own])

    def _rim_errors(self, label: int, at, across) -> tuple[float, float]:
        """Errors of slope and curvature of a piece at its rim, by its extent across the rim."""
        points = self.evidence.samples.points[self.members[label]]
        half = half_extent(points, at, across, self.labels.pieces[label], 2.0 * self.step)
        kind = self.labels.pieces[label].kind
        return rim_errors(kind, self.misfits[label], max(half, self.step))

    def _one_holds(self, a: int, b: int, middles) -> bool:
        """Whether one quartic explains the samples about a boundary as well as both pieces do."""
        points, tree = self.evidence.samples.points, cKDTree(middles)
        costs, about = 0.0, []
        for label in (a, b):
            members = self.members[label]
            near = members[tree.query(points[members])[0] < _WINDOW * self.step]
            distance = self.evidence.compare(self.labels.pieces[label], near)[0]
            costs += self.evidence.misfit(distance).sum()
            about.append(near)
        both = np.sort(np.concatenate(about))
        if len(both) < _FEW:
            return True
        one = self.evidence.fit(Kind.QUARTIC, both)
        if one is None:
            return False
        together = self.evidence.misfit(self.evidence.compare(one, both)[0]).sum()
        return bool(together - costs < _BETTER)

    def _sides(self, a: int, b: int, at) -> EdgeKind | None:
        """Whether an edge at points (m, 3) is convex or concave: the near samples of each piece lie
        below the other, or above. None where they lie on both sides, so that a piece goes on."""
        sides = []
        for one, other in ((a, b), (b, a)):
            points = self.evidence.samples.points[self.members[other]]
            _, near = cKDTree(points).query(at, k=min(_BESIDE, len(points)))
            offset = points[near.reshape(len(at), -1)] - at[:, None]
            normals = self.labels.pieces[one].at(at)[1]
            edge = cross(normals, self.labels.pieces[other].at(at)[1])[:, None]
            along = (offset * edge).sum(axis=2) ** 2
            square = (offset * offset).sum(axis=2) * (edge * edge).sum(axis=2)
            height = (offset * normals[:, None]).sum(axis=2)
            # Those along the edge may lie beyond its end.
            beside = (along < 0.25 * square) & (np.abs(height) > 3.0 * self.evidence.samples.std)
            far = height[beside]
            sides.append(float(np.sign(far).mean()) if len(far) else 0.0)
        if max(sides) < -_ONE_SIDE:
            return EdgeKind.SHARP_CONVEX
        return EdgeKind.SHARP_CONCAVE if min(sides) > _ONE_SIDE else None
