"""Doubts that samples raise: what they say against the surface and its rims."""

import numpy as np

from touchatlas.atlas.check.doubt import Doubt, count_of, extent_of, some_apart
from touchatlas.atlas.state import AtlasState

# Fraction of the samples that may contradict: good explorations have none. Doubled, one bad
# contact in five hundred is no doubt.
_FEW = 1e-3
# Distance of a sample from the surface that contradicts it, in deviations of both: chance gives one
# in two million. Doubled, only gross errors are doubted.
_FAR = 5.0
# Least fraction of the squared distances that one shift of the object explains, and that shift in
# deviations of a sample. Doubled, few moves are told from detail.
_EXPLAINED, _SHIFT = 0.5, 1.0
# Moments at which an object may have moved, in parts of the samples: each tenth. Doubled, a move
# within the last twentieth is seen.
_MOMENTS = np.arange(1, 10) / 10.0
# Distance of two sheets below which their triangles may run into each other, in tolerances.
# Doubled, walls are doubted that are drawn right.
_CLOSE = 4.0


def sample_doubts(atlas: AtlasState) -> list[Doubt]:
    """What the samples of an atlas say against it."""
    if atlas.body is None:
        return []
    points = atlas.pool.points
    found, _ = atlas.body.at(points)
    extent = extent_of(points)
    moved = _moved(atlas, found, extent)
    beside = moved or _contradictions(atlas, found, extent)
    return [*beside, *_close_sheets(atlas), *_lost_contact(atlas, extent)]


def _moved(atlas: AtlasState, found, extent: float) -> list[Doubt]:
    """One doubt where a move of the object explains how far samples lie off the surface.

    The surface passes between the samples of before and after. A later sample lies off it by
    n . t / 2 with the move t, an earlier one by -n . t / 2.
    """
    order = np.arange(len(found.distance)) / len(found.distance)
    square = float(found.distance @ found.distance)
    best, shift = 0.0, np.zeros(3)
    for moment in _MOMENTS:
        signed = np.where(order < moment, -0.5, 0.5)[:, None] * found.normal
        trial = np.linalg.lstsq(signed, found.distance, rcond=None)[0]
        rest = found.distance - signed @ trial
        explained = 1.0 - float(rest @ rest) / max(square, np.finfo(float).tiny)
        if explained > best:
            best, shift = explained, trial
    length = float(np.linalg.norm(shift))
    if not (best > _EXPLAINED and length > _SHIFT * atlas.sample_std):
        return []
    off = np.abs(found.distance) > atlas.sample_std
    words = (
        f"{off.mean():.1%} of the samples lie beside the surface as if the object had moved by "
        f"{length:.3g} or more; fix it, and explore again."
    )
    return [Doubt("moved", words, some_apart(atlas.pool.points[off], extent))]


def _contradictions(atlas: AtlasState, found, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside the surface."""
    off = np.abs(found.distance) > _FAR * np.hypot(atlas.sample_std, found.deviation)
    if off.sum() <= _FEW * len(off):
        return []
    words = (
        f"{off.mean():.1%} of the samples lie more than five deviations beside the surface; there "
        "is an edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, some_apart(atlas.pool.points[off], extent))]


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
        f"The surface ends where {count_of(count, 'contour', 'contours')} lost contact and nothing "
        "was met beyond; where the object goes on, the probe slipped: touch there again."
    )
    places = atlas.rims.unsure(atlas.tolerance)[0]
    if len(places):
        words += " The rim is not known to the tolerance everywhere."
    return [Doubt("lost contact", words, some_apart(places, extent))]
