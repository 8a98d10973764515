"""Doubts that samples raise: what they say against the surface, its rims and its edges."""

import numpy as np

from touchatlas.atlas.body.uncrossed_edges import guessed_edges
from touchatlas.atlas.check.doubt import Doubt, some_apart
from touchatlas.atlas.check.faults import moved_object
from touchatlas.atlas.labels.samples import split_contours
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.words import count_of

# Fraction of the samples that may contradict: good explorations have none. Doubled, one bad
# contact in five hundred is no doubt.
_FEW = 1e-3
# Distance of a sample from the surface that contradicts it, in deviations of both: chance gives one
# in two million. Doubled, only gross errors are doubted.
_FAR = 5.0
# Share of the samples of a contour that lie beside the polynomials for it to be beside them, and
# share of such contours from which they are fine detail. With the first doubled no contour is, with
# the second doubled, rough bodies are doubted.
_MOST, _FEW_CONTOURS = 0.5, 0.05
# Distance of two sheets below which their triangles may run into each other, in tolerances.
# Doubled, walls are doubted that are drawn right.
_CLOSE = 4.0


def sample_doubts(atlas: AtlasState) -> list[Doubt]:
    """What the samples of an atlas say against it."""
    if atlas.body is None:
        return []
    points = atlas.pool.points
    found, _ = atlas.body.at(points)
    extent = box_diagonal(points)
    beside = [] if moved_object(atlas) else _contradictions(atlas, found, extent)
    return [*beside, *_close_sheets(atlas), *_lost_contact(atlas, extent)]


def _contradictions(atlas: AtlasState, found, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside the surface."""
    off = np.abs(found.distance) > _FAR * np.hypot(atlas.sample_stds, found.deviation)
    off |= _contours_beside(atlas)
    if off.sum() <= _FEW * len(off):
        return []
    words = (
        f"{off.mean():.1%} of the samples lie more than five deviations beside the surface; there "
        "is an edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, some_apart(atlas.pool.points[off], extent))]


def _contours_beside(atlas: AtlasState) -> np.ndarray:
    """(n,) the samples of the few contours most of which lie beside the polynomials of the other
    ones, which the texture of the surface follows; none where many do."""
    body = atlas.body
    if body is None or not body.is_one_face:
        return np.zeros(atlas.point_count, bool)
    # The polynomials bend toward the contour, and are unsure there.
    smooth = body.field.trees.of(0).distances(atlas.pool.points)
    off = np.abs(smooth) > _FAR * atlas.sample_stds
    contours = split_contours(atlas.pool.points, atlas.pool.contours)[0]
    beside = np.bincount(contours, off) > _MOST * np.bincount(contours)
    return beside[contours] if beside.mean() <= _FEW_CONTOURS else np.zeros(len(off), bool)


def _close_sheets(atlas: AtlasState) -> list[Doubt]:
    """One doubt where two sides of the body are close to each other."""
    limit = _CLOSE * atlas.tolerance
    if atlas.body is None or atlas.body.thickness > limit:
        return []
    words = (
        f"Two sheets are less than {limit:.3g} apart, and the surface between them is not certain; "
        "give a smaller tolerance, or look there."
    )
    return [Doubt("close sheets", words, np.zeros((0, 3)))]


def _lost_contact(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Ends of contours at which the surface is drawn to end."""
    count = len(atlas.rims)
    if not count:
        return []
    words = (
        f"The surface ends where {count_of(count, 'contour')} lost contact and nothing "
        "was met beyond; where the object goes on, the probe slipped: touch there again."
    )
    places = atlas.rims.unsure(atlas.tolerance)[0]
    if len(places):
        words += " The rim is not known to the tolerance everywhere."
    return [Doubt("lost contact", words, some_apart(places, extent))]


def edge_doubts(atlas: AtlasState) -> list[Doubt]:
    """One doubt where edges are drawn sharp by a guess."""
    if atlas.body is None:
        return []
    guessed = guessed_edges(atlas.body, atlas.tolerance)
    if not len(guessed.points):
        return []
    words = (
        f"{count_of(len(guessed.points), 'edge is', 'edges are')} drawn sharp that no contour "
        f"crossed, though most are rounded, by {guessed.radius:.3g} in the median; touch there."
    )
    places = some_apart(guessed.points, box_diagonal(atlas.pool.points))
    return [Doubt("guessed edges", words, places)]
