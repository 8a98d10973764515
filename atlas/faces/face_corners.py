"""Corners of three faces whose edges are rounded alike: the ball that touches all three."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edges.rolling_ball import rounded_corner

if TYPE_CHECKING:
    from touchatlas.atlas.faces.faces import Face, FaceEdge


@dataclass(frozen=True, eq=False)
class FaceCorner:
    """A corner of three faces that is rounded with one ball.

    Parameters
    ----------
    faces : tuple of int
        Ids of the three faces, ascending.
    sign : float
        1 for a convex corner, -1 for a concave one.
    radius : float, length
        Mean of those of its edges.
    centre : (3,) float, length, world
        Of the ball.
    samples : (m,) int
        Samples of no face that lie on the ball, ascending.
    """

    faces: tuple[int, int, int]
    sign: float
    radius: float
    centre: np.ndarray
    samples: np.ndarray


def find_corners(
    faces: "tuple[Face, ...]", edges: "tuple[FaceEdge, ...]", points, loose, std: float, sure: float
) -> tuple[FaceCorner, ...]:
    """The rounded corners of faces, in order of their faces.

    Parameters
    ----------
    points : (n, 3) float, length, world
        All samples.
    loose : (m,) int
        Those of no face, ascending.
    std : float, length
        Standard deviation of a sample.
    sure : float
        Distance from the ball of the samples that it explains, in such deviations.
    """
    found = []
    for three, rounded in _triples(edges):
        sign, radius = rounded[0].kind.sign, float(np.mean([edge.radius for edge in rounded]))
        curves = [curve for edge in rounded for curve in edge.curves]
        if not curves:
            continue
        centre = _centre([faces[k].pieces[0] for k in three], sign * radius, np.concatenate(curves))
        if centre is not None:
            corner = FaceCorner(three, sign, radius, centre, loose[:0])
            members = loose[on_ball(corner, faces, points[loose], sure * std)]
            found.append(replace(corner, samples=members))
    return tuple(found)


def on_ball(corner: FaceCorner, faces: "tuple[Face, ...]", points, off: float) -> np.ndarray:
    """(n,) whether points (n, 3) lie between the three faces of a corner, no farther than ``off``
    from its ball, length."""
    values = [faces[k].pieces[0].at(points) for k in corner.faces]
    distances = corner.sign * np.stack([distance for distance, _ in values], axis=1)
    normals = np.stack([normal for _, normal in values], axis=1)
    radius = np.full(len(points), corner.radius)
    away, _, between = rounded_corner(distances, normals, radius)
    return np.asarray(between & (np.abs(away) < off) & (distances > -corner.radius).all(axis=1))


def _triples(
    edges: "tuple[FaceEdge, ...]",
) -> "Iterator[tuple[tuple[int, int, int], list[FaceEdge]]]":
    """Three faces, each two of which have a rounded edge, all convex or all concave; and these."""
    blunt = {(e.first, e.second): e for e in edges if e.radius > 0.0}
    around: dict[int, list[int]] = {}
    for one, other in sorted(blunt):
        around.setdefault(one, []).append(other)
    for one, others in around.items():
        for two, three in combinations(others, 2):
            pairs = (one, two), (one, three), (two, three)
            rounded = [blunt[pair] for pair in pairs if pair in blunt]
            if len(rounded) == 3 and len({edge.kind for edge in rounded}) == 1:
                yield (one, two, three), rounded


def _centre(pieces, depth: float, ends) -> np.ndarray | None:
    """The point (3,) at a depth within all of three pieces, from the point of their edges (k, 3)
    that is nearest to all; None where they have no corner there."""
    away = np.max([np.abs(piece.at(ends)[0]) for piece in pieces], axis=0)
    point = ends[away.argmin()]
    for _ in range(8):
        values = [piece.at(point[None]) for piece in pieces]
        normals = np.concatenate([normal for _, normal in values])
        if abs(np.linalg.det(normals)) < 0.05:
            return None
        distances = np.concatenate([distance for distance, _ in values])
        point = point - np.linalg.solve(normals, distances + depth)
    return np.asarray(point)
