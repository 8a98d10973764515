"""Behind edges: guesses where the face behind the end of a contour may be touched."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.place.choose import Target
from touchatlas.planner.probe_plan import Reason

# Guesses at the far face in turn: whether the edge is convex, and how far from the edge to touch,
# in reaches. The near ones are for thin walls, low steps and blunt edges. With distances doubled,
# touches miss the sides of thinner bodies.
_GUESSES = ((True, 0.3), (False, 0.3), (True, 0.08), (False, 0.08))
# Number of steps over which the direction of travel is measured. Doubled, it has half the noise and
# twice the error from curvature.
_RUN = 3
# Largest distance of an end from another face that shows its far side, in steps: it is up to one
# step, and half a step is for noise. Doubled, edges of faces three steps apart are confused.
_EDGE_STEPS = 1.5
# Largest cosine of the angle between the normals of different faces: 20 degrees. Doubled in angle,
# ends at blunt edges are never done.
_OTHER_FACE = np.cos(np.deg2rad(20.0))


@dataclass(frozen=True, eq=False)
class EdgeEnds:
    """The k ends of contours at edges, as arrays.

    Parameters
    ----------
    points : (k, 3) float, length, world
        The last sample before the edge.
    tangents, normals : (k, 3) float, unit, world
        Direction of travel at the end, and outward normal of the face.
    steps : (k,) float, length
        Distance between samples.
    """

    points: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray
    steps: np.ndarray

    def some(self, index) -> "EdgeEnds":
        """Those of an index or mask."""
        return EdgeEnds(*(column[index] for column in vars(self).values()))


def unknown_ends(atlas: Atlas) -> EdgeEnds:
    """The ends of contours at edges whose far side no other face is known to be."""
    ends = _all_ends(atlas)
    if not len(ends.points) or atlas.body is None:
        return ends
    trees, passed = atlas.body.field.trees, np.zeros(len(ends.points), bool)
    for face in atlas.body.faces.faces:
        found = trees.values(face.id, ends.points)
        other = (found[:, 1:4] * ends.normals).sum(axis=1) < _OTHER_FACE
        near = np.abs(found[:, 0]) <= _EDGE_STEPS * ends.steps
        passed |= other & near & (trees.away(face.id, ends.points) <= atlas.body.reach)
    return ends.some(~passed)


def edge_target(ends: EdgeEnds, position, tried, scale: float, reach: float) -> Target | None:
    """The next guess at a face behind an edge, for arms of a length ``reach``; None when all were
    made. Ends with the fewest guesses come first, and of these the one nearest to the probe.

    Parameters
    ----------
    ends : EdgeEnds
    position : (3,) float, length, world
        Where the probe is.
    tried : (m, 3) float, length, world
        The end of each guess that was made before; the new one is to be added.
    scale : float, length
        Distance within which two ends are one.
    reach : float, length
    """
    number = _guesses(ends, tried, scale)
    if not len(number) or number.min() >= len(_GUESSES):
        return None
    away = ((ends.points - position) ** 2).sum(axis=1)
    i = int(np.lexsort((away, number))[0])
    convex, fraction = _GUESSES[number[i]]
    tangent, normal, half = ends.tangents[i], ends.normals[i], 0.5 * ends.steps[i]
    edge = ends.points[i] + half * tangent
    tried.append(ends.points[i])
    # Behind a convex edge the face is taken to fall away at a right angle, with its outward normal
    # along the travel. Behind a concave edge it is taken to rise, facing back.
    if convex:
        return Target(edge - fraction * reach * normal + half * tangent, tangent, Reason.EXPAND)
    return Target(edge + fraction * reach * normal, -tangent, Reason.EXPAND)


def _guesses(ends: EdgeEnds, tried, scale: float) -> np.ndarray:
    """(k,) number of guesses that were made behind each end."""
    offset = ends.points[:, None] - np.reshape(tried, (-1, 3))
    return np.asarray(((offset * offset).sum(axis=2) <= scale**2).sum(axis=1))


def _all_ends(atlas: Atlas) -> EdgeEnds:
    """The ends of contours at edges, from the samples."""
    pool, found = atlas.pool, []
    for i in np.flatnonzero(pool.edges).tolist():
        inner = _inner(pool, i)
        chord = pool.points[i] - pool.points[inner]
        length = float(np.sqrt(chord @ chord))
        if inner != i and length > 0.0:
            tangent = chord - (chord @ pool.normals[i]) * pool.normals[i]
            size = max(float(np.sqrt(tangent @ tangent)), np.finfo(float).tiny)
            step = length / abs(i - inner)
            found.append((pool.points[i], tangent / size, pool.normals[i], step))
    columns = zip(*found, strict=True) if found else ([], [], [], [])
    points, tangents, normals, steps = (np.array(column, float) for column in columns)
    points, tangents, normals = (np.reshape(c, (-1, 3)) for c in (points, tangents, normals))
    return EdgeEnds(points, tangents, normals, steps)


def _inner(pool, i: int) -> int:
    """The sample some steps within the contour from the one at its end i."""
    for sign in (-1, 1):
        way = i + sign * np.arange(1, _RUN + 1)
        way = way[(way >= 0) & (way < len(pool))]
        same = (pool.across[way] == pool.across[i]).all(axis=1)
        count = len(way) if same.all() else int(same.argmin())
        step = np.linalg.norm(np.diff(pool.points[[i, *way[:count]]], axis=0), axis=1)
        if count and step.max() < _EDGE_STEPS * 2.0 * step.min():
            return int(way[count - 1])
    return i
