"""BezierTree: Bezier faces between sides that neighbours share, each a curve that may have halves.

A face beside a longer one shares a half of its side. Both are the same curve, so that no gap opens.
"""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas.cad.bezier.bezier import coons, hermite
from touchatlas.atlas.cad.bezier.fit_bezier import At, fit_curves, fit_faces

# A side, and whether it is followed forward.
Use = tuple[int, bool]


@dataclass(frozen=True, eq=False)
class Side:
    """A curve between two vertices.

    Parameters
    ----------
    start, end : int
        Vertices.
    control : (n + 1, 3) float, length
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
    degree : int
        Of curves and faces, at least 3.
    vertices : list of (3,) float, length
    normals : list of (3,) float, unit
        Of the surface at the vertices.
    sides : list of Side
    faces : list of four Use
        The sides in turn, counter-clockwise as seen from outside.
    controls : list of (n + 1, n + 1, 3) float, length
        Of each face: u runs along its first side, v along its second.
    """

    degree: int
    vertices: list[np.ndarray] = field(default_factory=list)
    normals: list[np.ndarray] = field(default_factory=list)
    sides: list[Side] = field(default_factory=list)
    faces: list[tuple[Use, ...]] = field(default_factory=list)
    controls: list[np.ndarray] = field(default_factory=list)

    def copy(self) -> "BezierTree":
        """The same, which may be changed."""
        return BezierTree(
            self.degree,
            list(self.vertices),
            list(self.normals),
            list(self.sides),
            list(self.faces),
            list(self.controls),
        )

    def control(self, use: Use) -> np.ndarray:
        """(n + 1, 3) control points of a side as it is followed."""
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
        guess = hermite(points[:, 0], points[:, 1], slopes[:, 0], slopes[:, 1], self.degree)
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


def first_tree(vertices, quads, at: At, degree: int) -> BezierTree:
    """One face for each quadrilateral (q, 4) between points (v, 3) near a surface."""
    tree = BezierTree(degree)
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
