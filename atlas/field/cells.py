"""Cells: faces, extended without end, divide space; samples say which parts lie inside."""

from functools import cache
from itertools import combinations

import numpy as np

from touchatlas.atlas.field.face_ends import FaceEnds
from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees
from touchatlas.atlas.field.rounded_edges import are_rounded, ball_distances
from touchatlas.atlas.field.sides import Sides
from touchatlas.atlas.field.smooth_rims import SmoothRims
from touchatlas.atlas.field.votes import Votes


class Cells:
    """The parts into which the faces, extended without end, divide space.

    A cell is known by the sides of all faces on which it lies. A sample of a face is a vote for two
    cells: the one on the inner side of that face is inside of the body, the one on its outer side
    is outside (the labels of the cells of an arrangement, as in A.-L. Chauve, P. Labatut, J.-P.
    Pons, "Robust piecewise-planar 3D reconstruction", CVPR 2010, but without their graph cut: a
    cell without votes has no label). A face ends at its edges, so that it divides nothing beyond
    them: three of the four parts beside an edge are one cell. A sample beside a blunt edge, where
    the rounding is on another side than the faces, has no vote.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    rims : SmoothRims
    """

    def __init__(self, trees: FaceTrees, reach: float, rims: SmoothRims) -> None:
        self._trees, self._rims, faces = trees, rims, trees.faces.faces
        self._noise = trees.faces.levels.sure * np.array([face.deviation for face in faces])
        # Faces of one surface divide space once, as the largest of them does; some face the other
        # way.
        self._one, self._way = trees.alike(self._noise)
        self._of_one = [np.flatnonzero(self._one == k) for k in range(len(faces))]
        self._two_ways = np.array([len(set(self._way[own].tolist())) > 1 for own in self._of_one])
        self._has_patches = np.array([trees.is_free_form(face.id) for face in faces] + [False])
        # The key of a cell is the exclusive or of those of the faces outside of which it lies
        # (A. L. Zobrist, 1970). Any distinct numbers serve.
        bits = np.random.default_rng(len(faces)).integers(1, 2**62, len(faces))
        self._bits = np.where(self._one == np.arange(len(faces)), bits, 0)
        self._ends = self._ends_of_faces()
        # Blunt edges at which both faces end, and these as first faces of their surfaces.
        every = self._ends[True].pairs + self._ends[False].pairs
        blunt = [edge for edge in trees.faces.edges if edge.radius > 0.0]
        pairs = [tuple(self._one[[edge.first, edge.second]].tolist()) for edge in blunt]
        self._blunt = [
            (edge, pair)
            for edge, pair in zip(blunt, pairs, strict=True)
            if pair in every and pair[::-1] in every
        ]
        self._votes = self._votes_of_samples(reach)

    @property
    def same_surface(self) -> np.ndarray:
        """(f,) the first face that is one surface with each face."""
        return self._one

    def sides(self, at: FacesAt) -> Sides:
        """On which sides of the surfaces n points lie."""
        distances = self._of_surfaces(at.points, at.distances)
        outside, off = distances > 0.0, self._off(at, distances)
        order = np.lexsort((np.abs(distances), off))[:, : min(6, np.count_nonzero(self._bits))]
        label = self._votes.labels(self._key(outside), at.points)
        return Sides(distances, outside, off, order, label)

    def decide(self, at: FacesAt, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
        """The face (n,) that votes show to be the surface of n points; -1 where they do not, or
        where it has several patches. And its distance, normal and variance (n, 5).

        They do where the cell of a point is known, and that beyond the nearest face is known to be
        on the other side.
        """
        outside, label, nearest = sides.outside, sides.label, sides.order[:, 0]
        count = len(label)
        beyond = self._across(outside, np.arange(count), nearest[:, None])
        shown = (label != 0.0) & (self._votes.labels(beyond, at.points) == -label)
        shown &= self._may_bound(sides.distances[np.arange(count), nearest], nearest, label)
        decides, chosen = np.full(count, -1), np.zeros((count, 5))
        self._move(at, nearest, label, np.flatnonzero(shown), decides, chosen)
        decides[self._has_patches[decides]] = -1
        return decides, chosen

    def settle(self, at: FacesAt, sides: Sides, away, owner, decides, chosen) -> np.ndarray:
        """Correct what was chosen where the votes of the cells on both sides contradict it.

        Parameters
        ----------
        at : FacesAt
            Of n points.
        sides : Sides
            Of these points.
        away : (n,) float, length
            From the nearest sample. The surface is no farther, so that no farther face is chosen.
        owner : (n,) int
            The face of each point, which goes on where nothing is known beyond it.
        decides : (n,) int
            The face that decides for each point; changed where another one does.
        chosen : (n, 5) float
            Distance, normal and variance there; changed as well.

        Returns
        -------
        (m,) int
            The points at which the votes contradict what was chosen, and name no other face.
        """
        distances, outside, order = sides.distances, sides.outside, sides.order
        before, shown = _side(chosen[:, 0]), sides.label != 0.0
        label = np.where(shown, sides.label, before)
        # On the face itself either side may be told: that of another face of its surface.
        clear = np.abs(chosen[:, 0]) > self._noise[decides]
        wrong = (before != label) & clear
        decided = (order == self._one[decides][:, None]) & (shown | clear)[:, None]
        # On the same side of the surface beyond the face that decided, with those before it and
        # without.
        rows, _, beyond = self._beyond(at.points, outside, order, decided)
        refuted = decided.any(axis=1)
        refuted[rows[beyond != label[rows]]] = False
        wrong |= refuted
        farthest = away + np.maximum(self._noise[owner], self._noise[decides])
        reach = np.where(wrong, farthest, np.abs(chosen[:, 0]))
        ordered = np.take_along_axis(distances, order, axis=1)
        asked = np.take_along_axis(sides.off, order, axis=1) < reach[:, None]
        asked &= self._may_bound(ordered, order, label[:, None])
        rows, face, beyond = self._beyond(at.points, outside, order, asked)
        goes_on = wrong[rows] & (beyond == 0.0) & (face == self._one[owner[rows]])
        hit = np.flatnonzero((beyond == -label[rows]) | goes_on)[::-1]
        found = np.full(len(distances), -1)
        # The first one comes last here, and stays.
        found[rows[hit]] = face[hit]
        moved = np.flatnonzero((found >= 0) & (found != self._one[decides]))
        self._move(at, found, label, moved, decides, chosen)
        return np.flatnonzero(wrong & (found < 0))

    def _beyond(self, points, outside, order, asked) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (m,) of points (n, 3) outside of faces (n, f), faces (m,), and labels (m,) of the
        cells beyond these, alone and with up to two that are nearer; for those of the nearest faces
        (n, k) that are asked."""
        subsets = _subsets(order.shape[1])
        rows, which = np.nonzero(asked[:, subsets[:, 0]])
        padded = np.column_stack([order, np.full(len(order), -1)])
        crossed = padded[rows[:, None], subsets[which]]
        beyond = self._votes.labels(self._across(outside, rows, crossed), points[rows])
        return rows, crossed[:, 0], beyond

    def _of_surfaces(self, points, distances) -> np.ndarray:
        """(n, f) distances of points (n, 3) from faces (n, f), where several faces are one surface
        those of the one with the nearest sample: far from its samples a face is not as exact."""
        out, rows = distances.copy(), np.arange(len(points))
        for one, faces in enumerate(self._of_one):
            if len(faces) > 1:
                nearest = self._trees.nearest_of(tuple(faces.tolist()), points)
                out[:, one] = self._way[nearest] * distances[rows, nearest]
        return out

    def _may_bound(self, distance, one, label) -> np.ndarray:
        """(n,) whether a face that is one surface with ``one`` (n,), at a distance (n,) from it,
        has points of a label (n,) on that side of it."""
        return np.asarray((_side(distance) == label) | self._two_ways[one])

    def _move(self, at: FacesAt, found, label, moved, decides, chosen) -> None:
        """Let the faces ``found`` (n,), or the nearest of those of one surface with it that face
        the side of the label (n,), decide for the points ``moved`` (m,)."""
        for one in np.unique(found[moved]).tolist():
            rows, faces = moved[found[moved] == one], self._of_one[one]
            decides[rows] = one
            if len(faces) > 1:
                away = np.stack([self._trees.away(k, at.points[rows]) for k in faces.tolist()])
                # One on whose own surface a point lies may be on either side of it.
                other = (_side(at.distances[rows][:, faces].T) != label[rows]) & self._two_ways[one]
                away[other] = np.inf
                decides[rows] = faces[away.argmin(axis=0)]
        for k in np.unique(decides[moved]).tolist():
            mine = moved[decides[moved] == k]
            chosen[mine] = at.values(k, mine)

    def _votes_of_samples(self, reach: float) -> Votes:
        """The votes of all samples that are clearly on one side of each other face, and not beside
        a rounding on another side than its faces are."""
        faces = self._trees.faces
        samples = np.concatenate([face.samples for face in faces.faces])
        own, way = self._one[faces.of[samples]], self._way[faces.of[samples]]
        points, distances = faces.points[samples], np.concatenate(self._trees.between)
        rounded = are_rounded(self._trees, points, distances, reach)
        distances = self._of_surfaces(points, distances)
        outside, clear = distances > 0.0, np.abs(distances) > self._noise
        rows = np.arange(len(own))
        clear[rows, own] = True
        clear |= self._bits == 0
        outside[rows, own] = way < 0.0
        inner = self._key(outside)
        outer = self._across(outside, rows, own[:, None])
        votes = clear.all(axis=1) & ~rounded & (inner != outer)
        return Votes(faces, self._rims, samples[votes], inner[votes], outer[votes])

    def _ends_of_faces(self) -> dict[bool, FaceEnds]:
        """By whether it is convex, each edge at which all samples of a face end: that face and the
        other one, as first faces of their surfaces."""
        out: dict[bool, list[tuple[int, int]]] = {True: [], False: []}
        for edge in self._trees.faces.edges:
            pair = self._one[[edge.first, edge.second]].tolist()
            if not edge.kind.sharp or pair[0] == pair[1] or self._two_ways[pair].any():
                continue
            for face, other in (pair, pair[::-1]):
                off = np.concatenate([self._trees.between[k][:, other] for k in self._of_one[face]])
                past = np.count_nonzero(edge.kind.sign * off > self._noise[other])
                if past <= max(1, 1e-3 * len(off)):
                    out[edge.kind.sign > 0.0].append((face, other))
        return {convex: FaceEnds(pairs) for convex, pairs in out.items()}

    def _canonical(self, outside) -> np.ndarray:
        """(n, f) the same outside of faces (n, f), but for what lies beyond the end of a face: at a
        convex edge all outside of the other face is outside, at a concave one all inside of it is
        inside, whatever side of the face it is on. No face ends at one that ends there in an edge
        of the other sign."""
        convex, concave = self._ends[True], self._ends[False]
        larger = convex.combine(np.logical_or, outside, outside)
        smaller = concave.combine(np.logical_and, outside, outside)
        out = convex.combine(np.logical_or, outside, smaller)
        return concave.combine(np.logical_and, out, larger)

    def _off(self, at: FacesAt, distances) -> np.ndarray:
        """(n, f) how far each face is at least from points at distances (n, f) from the faces
        without ends: beyond an edge, as far as the other face of it; beside a blunt edge, as far as
        its ball."""
        away = np.abs(distances)
        out = np.where(self._bits == 0, np.inf, away)
        for convex, ends in self._ends.items():
            beyond = np.where((distances > 0.0) == convex, away, 0.0)
            out = ends.combine(np.maximum, out, beyond)
        for edge, pair in self._blunt:
            rows, ball = ball_distances(edge, at)
            beyond = self._is_beyond(distances[rows], *pair)
            beyond |= self._is_beyond(distances[rows], *pair[::-1])
            rows = rows[~beyond, None]
            out[rows, pair] = np.maximum(out[rows, pair], ball[~beyond, None])
        return out

    def _is_beyond(self, distances, face: int, partner: int) -> np.ndarray:
        """(n,) whether points at distances (n, f) from the faces lie beyond an edge at which a face
        ends, other than that with its partner."""
        out = np.zeros(len(distances), bool)
        for convex, ends in self._ends.items():
            for own, other in ends.pairs:
                if own == face and other != partner:
                    out |= (distances[:, other] > 0.0) == convex
        return out

    def _across(self, outside, rows, faces) -> np.ndarray:
        """(m,) keys of the cells that one enters from points ``rows`` (m,), outside of faces
        (n, f), across some ``faces`` (m, k) at once; none where that is -1."""
        bits = np.append(self._bits, 0)
        raw = np.bitwise_xor.reduce(np.where(outside, self._bits, 0), axis=1)[rows]
        raw ^= np.bitwise_xor.reduce(bits[faces], axis=1)
        _, index, inverse = np.unique(raw, return_index=True, return_inverse=True)
        there = np.column_stack([outside[rows[index]], np.zeros(len(index), bool)])
        for column in faces[index].T:
            there[np.arange(len(index)), column] ^= True
        return self._key(there[:, :-1])[inverse]

    def _key(self, outside) -> np.ndarray:
        """(n,) keys of the cells outside of faces (n, f)."""
        outside = self._canonical(outside)
        return np.asarray(np.bitwise_xor.reduce(np.where(outside, self._bits, 0), axis=1))


def _side(distance) -> np.ndarray:
    """1 outside, -1 inside, as of distances (n,) that are not above zero."""
    return np.where(distance > 0.0, 1.0, -1.0)


@cache
def _subsets(count: int) -> np.ndarray:
    """(s, 3) sets of up to three of so many nearest faces, the farthest first, padded with -1: by
    the farthest of them, then by their number. They are crossed at once at an edge or a corner."""
    sizes = range(1, 4)
    found = [some for size in sizes for some in combinations(range(count), size)]
    found.sort(key=lambda some: (some[-1], len(some), some))
    return np.array([(*some[::-1], *[-1] * (3 - len(some))) for some in found])
