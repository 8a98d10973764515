"""Halve faces: four Bezier faces in the place of one, each fitted to the surface again."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.cad.bezier.bezier import curve_points, face_points, halves
from touchatlas.atlas.cad.bezier.bezier_tree import BezierTree, Side, onto
from touchatlas.atlas.cad.bezier.fit_bezier import At


def with_halved(tree: BezierTree, faces, at: At) -> tuple[BezierTree, np.ndarray]:
    """A tree with four faces in the place of each of some.

    Where both faces of a side are halved, its halves are fitted again. Where one is, they are the
    halves of the same curve (de Casteljau).

    Parameters
    ----------
    tree : BezierTree
    faces : (k,) int
    at : function
        Signed distance and normal of the surface near points.

    Returns
    -------
    tree : BezierTree
    numbers : (k, 4) int
        The faces in the place of each; the first has its number.
    """
    tree, chosen = tree.copy(), {int(k) for k in faces}
    kept = {s for k, uses in enumerate(tree.faces) for s in _kept(tree, uses, k in chosen)}
    cut = {use[0] for k in chosen for use in tree.faces[k] if tree.sides[use[0]].halves is None}
    _halve_same(tree, sorted(cut & kept), at)
    _halve_anew(tree, sorted(cut - kept), at)
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


def _middles(tree: BezierTree, sides) -> np.ndarray:
    """(k, 3) middles of sides."""
    return curve_points(np.array([tree.sides[s].control for s in sides]), [0.5])[:, 0]


def _ends(tree: BezierTree, sides) -> np.ndarray:
    """(2 k, 2) vertices at the ends of the halves of sides, whose middles are the last vertices."""
    middle = len(tree.vertices) - len(sides) + np.arange(len(sides))
    start, end = np.array([(tree.sides[s].start, tree.sides[s].end) for s in sides]).T
    return np.stack([start, middle, middle, end], axis=1).reshape(-1, 2)


def _halve_same(tree: BezierTree, sides, at: At) -> None:
    """Halve sides so that their halves are the same curves."""
    if not sides:
        return
    tree.add_vertices(_middles(tree, sides), at)
    pairs = halves(np.array([tree.sides[s].control for s in sides]))
    controls = np.stack(pairs, axis=1).reshape(-1, tree.degree + 1, 3)
    ends = _ends(tree, sides).tolist()
    tree.sides += [Side(a, b, c) for (a, b), c in zip(ends, controls, strict=True)]
    _enter(tree, sides)


def _halve_anew(tree: BezierTree, sides, at: At) -> None:
    """Halve sides and fit both halves to the surface."""
    if not sides:
        return
    tree.add_vertices(onto(_middles(tree, sides), at), at)
    tree.add_sides(_ends(tree, sides), at)
    _enter(tree, sides)


def _enter(tree: BezierTree, sides) -> None:
    """Let the last sides be the halves of these."""
    first = len(tree.sides) - 2 * len(sides)
    for place, s in enumerate(sides):
        pair = (first + 2 * place, first + 2 * place + 1)
        tree.sides[s] = replace(tree.sides[s], halves=pair)


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
    four = [
        (
            tree.half(uses[k], 0),
            (spokes[k], True),
            (spokes[k - 1], False),
            tree.half(uses[k - 1], 1),
        )
        for k in range(4)
    ]
    numbers = [face, *range(len(tree.faces), len(tree.faces) + 3)]
    tree.faces[face] = four[0]
    tree.faces += four[1:]
    tree.controls += [np.zeros(0)] * 3
    return numbers
