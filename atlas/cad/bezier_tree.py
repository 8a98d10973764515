"""BezierTree: bicubic Bezier faces between cubic sides that neighbours share, perhaps by halves.

A face next to a larger one shares a half of its side: the same curve, so that no gap opens.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from touchatlas.atlas.cad.bezier import (
    At,
    coons,
    curve_points,
    face_points,
    fit_curves,
    fit_faces,
    halves,
    hermite,
)

# A side, and whether it is followed forward.
Use = tuple[int, bool]


@dataclass(frozen=True, eq=False)
class Side:
    """A curve between two vertices.

    Parameters
    ----------
    start, end : int
        Vertices.
    control : (4, 3) float, length
    halves : pair of int, optional
        The sides from the start to its middle, and from there to the end.
    """

    start: int
    end: int
    control: np.ndarray
    halves: tuple[int, int] | None = None


@dataclass(eq=False)
class BezierTree:
    """Faces, and the sides and vertices that they share.

    Parameters
    ----------
    vertices : list of (3,) float, length
    normals : list of (3,) float, unit
        Of the surface at the vertices.
    sides : list of Side
    faces : list of four Use
        The sides in turn, counter-clockwise as seen from outside.
    controls : list of (4, 4, 3) float, length
        Of each face: u runs along its first side, v along its second.
    """

    vertices: list[np.ndarray] = field(default_factory=list)
    normals: list[np.ndarray] = field(default_factory=list)
    sides: list[Side] = field(default_factory=list)
    faces: list[tuple[Use, ...]] = field(default_factory=list)
    controls: list[np.ndarray] = field(default_factory=list)

    def copy(self) -> "BezierTree":
        """The same, which may be changed."""
        corners = self.vertices[:], self.normals[:]
        return BezierTree(*corners, self.sides[:], self.faces[:], self.controls[:])

    def control(self, use: Use) -> np.ndarray:
        """(4, 3) control points of a side as it is followed."""
        return self.sides[use[0]].control[:: 1 if use[1] else -1]

    def start(self, use: Use) -> int:
        """The vertex at which a side starts as it is followed."""
        side = self.sides[use[0]]
        return side.start if use[1] else side.end

    def half(self, use: Use, place: int) -> Use:
        """The first, 0, or second, 1, half of a side as it is followed."""
        parts = self.sides[use[0]].halves
        assert parts is not None
        return parts[place if use[1] else 1 - place], use[1]

    def parts(self, side: int) -> list[int]:
        """A side, its halves, and theirs."""
        halves = self.sides[side].halves or ()
        return [side, *(part for half in halves for part in self.parts(half))]

    def edges(self, uses) -> list[tuple[Use, np.ndarray, np.ndarray]]:
        """The smallest parts of the sides of a face in turn, each with the parameters (2,) of the
        face at which it starts and ends as it is followed."""
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        ends = zip(uses, corners, np.roll(corners, -1, axis=0), strict=True)
        return [part for use, first, last in ends for part in self._leaves(use, first, last)]

    def _leaves(self, use: Use, first, last) -> list[tuple[Use, np.ndarray, np.ndarray]]:
        """The smallest parts of a side between parameters (2,)."""
        if self.sides[use[0]].halves is None:
            return [(use, first, last)]
        middle = 0.5 * (first + last)
        one = self._leaves(self.half(use, 0), first, middle)
        return one + self._leaves(self.half(use, 1), middle, last)

    def add_vertices(self, points, at: At) -> None:
        """Append points (n, 3) on the surface as vertices."""
        self.vertices += list(points)
        self.normals += list(at(points)[1])

    def add_sides(self, ends, at: At) -> None:
        """Append sides between vertices (e, 2), fitted to the surface.

        The first guess is a cubic whose slopes are the chord turned into the tangent planes.
        """
        points, normals = np.array(self.vertices)[ends], np.array(self.normals)[ends]
        chord = points[:, 1] - points[:, 0]
        rise = np.einsum("ec,ekc->ek", chord, normals)
        slopes = chord[:, None] - rise[..., None] * normals
        length = np.maximum(np.linalg.norm(slopes, axis=2), np.finfo(float).tiny)
        slopes *= (np.linalg.norm(chord, axis=1)[:, None] / length)[..., None]
        guess = hermite(points[:, 0], points[:, 1], slopes[:, 0], slopes[:, 1])
        fitted = fit_curves(guess, at, normals)
        self.sides += [Side(a, b, c) for (a, b), c in zip(ends.tolist(), fitted, strict=True)]

    def fit(self, faces, at: At) -> None:
        """Fit faces (k,) to the surface between their sides."""
        sides = np.array([[self.control(use) for use in self.faces[k]] for k in faces])
        for k, control in zip(faces, fit_faces(coons(sides), at), strict=True):
            self.controls[k] = control


def onto(points, at: At) -> np.ndarray:
    """Points (n, 3) moved onto the surface."""
    # The second step leaves the square of what the first one left.
    for _ in range(2):
        distance, normal = at(points)
        points = points - distance[:, None] * normal
    return np.asarray(points)


def first_tree(vertices, quads, at: At) -> BezierTree:
    """One face for each quadrilateral (q, 4) between points (v, 3) near a surface."""
    tree = BezierTree()
    number: dict[tuple[int, int], int] = {}
    tree.add_vertices(onto(vertices, at), at)
    for quad in quads.tolist():
        ends = zip(quad, [*quad[1:], quad[0]], strict=True)
        keys = [((min(two), max(two)), two[0] < two[1]) for two in ends]
        uses = [(number.setdefault(key, len(number)), forward) for key, forward in keys]
        tree.faces.append(tuple(uses))
    tree.add_sides(np.array(list(number)), at)
    tree.controls = [np.zeros(0)] * len(tree.faces)
    tree.fit(range(len(tree.faces)), at)
    return tree


def with_halved(tree: BezierTree, faces, at: At) -> tuple[BezierTree, np.ndarray]:
    """A tree with four faces in the place of each face (k,), and their numbers (k, 4); the first
    keeps the number.

    Where both faces of a side are halved, its halves are fitted again. Where one is, they are the
    halves of the same curve (de Casteljau).
    """
    tree, chosen = tree.copy(), {int(k) for k in faces}
    kept = {s for k, uses in enumerate(tree.faces) for s in _kept(tree, uses, k in chosen)}
    cut = {use[0] for k in chosen for use in tree.faces[k] if tree.sides[use[0]].halves is None}
    _halve(tree, sorted(cut & kept), at, is_same=True)
    _halve(tree, sorted(cut - kept), at, is_same=False)
    spokes = _add_spokes(tree, faces, at)
    numbers = np.array(
        [_quarter(tree, int(k), four) for k, four in zip(faces, spokes, strict=True)]
    )
    tree.fit(numbers.ravel().tolist(), at)
    return tree, numbers


def _kept(tree: BezierTree, uses, is_halved: bool) -> list[int]:
    """The sides that must stay what they are because a face has them as parts of its own: its sides
    too, unless it is halved."""
    return [part for use in uses for part in tree.parts(use[0])[1 if is_halved else 0 :]]


def _halve(tree: BezierTree, sides: list[int], at: At, is_same: bool) -> None:
    """Halve sides: the halves are the same curves, or both are fitted to the surface."""
    if not sides:
        return
    controls = np.array([tree.sides[s].control for s in sides])
    middles, first = curve_points(controls, [0.5])[:, 0], len(tree.vertices)
    tree.add_vertices(middles if is_same else onto(middles, at), at)
    ends = [[tree.sides[s].start, first + k, tree.sides[s].end] for k, s in enumerate(sides)]
    pairs = [pair for a, b, c in ends for pair in ((a, b), (b, c))]
    number = len(tree.sides)
    if is_same:
        both = np.stack(halves(controls), axis=1).reshape(-1, 4, 3)
        tree.sides += [Side(*pair, half) for pair, half in zip(pairs, both, strict=True)]
    else:
        tree.add_sides(np.array(pairs), at)
    for k, s in enumerate(sides):
        tree.sides[s] = replace(tree.sides[s], halves=(number + 2 * k, number + 2 * k + 1))


def _add_spokes(tree: BezierTree, faces, at: At) -> np.ndarray:
    """(k, 4) sides from the middles of the sides of each face to its own middle."""
    first = len(tree.vertices)
    points = face_points(np.array([tree.controls[k] for k in faces]), [0.5], [0.5])[:, 0]
    tree.add_vertices(onto(points, at), at)
    ends = [
        (tree.start(tree.half(use, 1)), first + place)
        for place, k in enumerate(faces)
        for use in tree.faces[k]
    ]
    tree.add_sides(np.array(ends), at)
    return np.arange(len(tree.sides) - len(ends), len(tree.sides)).reshape(-1, 4)


def _quarter(tree: BezierTree, face: int, spokes) -> list[int]:
    """Four faces, one at each corner, in the place of one with spokes (4,)."""
    uses, spokes = tree.faces[face], spokes.tolist()
    inner = [((spokes[k], True), (spokes[k - 1], False)) for k in range(4)]
    four = [(tree.half(uses[k], 0), *inner[k], tree.half(uses[k - 1], 1)) for k in range(4)]
    numbers = [face, *range(len(tree.faces), len(tree.faces) + 3)]
    tree.faces[face] = four[0]
    tree.faces += four[1:]
    tree.controls += [np.zeros(0)] * 3
    return numbers
