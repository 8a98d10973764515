"""Moved: whether the object moved between two touches, as the samples of before and after tell."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.body.choose import body_of_one
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.state import AtlasState

# Root mean square of the distances of one half of the samples from the surface of the other, in
# deviations of both, below which nothing moved: it is 1 where all is well. Doubled, small moves are
# not seen.
_BESIDE = 3.0
# Deviation of the surface of one half of the samples, in those of a sample, above which it tells
# nothing: where that half holds some of before and some of after, its sextics differ by the move.
# Doubled, nothing changes.
_VAGUE = 2.0
# Moments at which an object may have moved, in parts of the samples: each tenth. Doubled, a move
# within the last twentieth is seen.
_MOMENTS = np.arange(1, 10) / 10.0


@dataclass(frozen=True, eq=False)
class _Beside:
    """Samples beside a surface, as arrays over all samples.

    Parameters
    ----------
    distance : (n,) float, no unit
        From the surface, in deviations of both; 0 where that is not known.
    normal : (n, 3) float, 1/length
        Of the surface there, over that deviation; 0 where that is not known.
    """

    distance: np.ndarray
    normal: np.ndarray


def shift_of_object(atlas: AtlasState, found) -> tuple[np.ndarray, np.ndarray]:
    """The shift (3,) of the object, length, and which samples (n,) lie beside the surface by it;
    none of them where nothing moved. ``found`` are the values of the body at the samples.

    The surface of laws passes between the samples of before and after: a later sample lies off it
    by n . t / 2 with the move t, an earlier one by -n . t / 2. A free-form surface bends to follow
    all of them, so that each half of the samples is compared with the surface of the other half.
    """
    count, stds = len(found.distance), atlas.sample_stds
    order, none = np.arange(count) / count, np.zeros(count, bool)
    if not atlas.known_body.is_one_face:
        all_of_them = _Beside(found.distance / stds, found.normal / stds[:, None])
        shift, explained = _shift(all_of_them, order, -0.5, 0.5, _MOMENTS)
        off = np.abs(found.distance) > stds
        return (shift, off) if _is_move(atlas, shift, explained) else (shift, none)
    early = order < 0.5
    later, before = _beside(atlas, early), _beside(atlas, ~early)
    tried = [
        (later, *_shift(later, order, 0.0, 1.0, _MOMENTS[_MOMENTS >= 0.5])),
        (before, *_shift(before, order, -1.0, 0.0, _MOMENTS[_MOMENTS <= 0.5])),
    ]
    beside, shift, explained = max(tried, key=lambda one: one[2])
    some = beside.normal.any(axis=1)
    rough = some.any() and np.sqrt(np.mean(beside.distance[some] ** 2)) > _BESIDE
    off = np.abs(beside.distance) > 1.0
    return (shift, off) if rough and _is_move(atlas, shift, explained) else (shift, none)


def _is_move(atlas: AtlasState, shift, explained: float) -> bool:
    """Whether a shift is more than a deviation of a sample, and explains most of what differs."""
    large = np.linalg.norm(shift) > atlas.sample_std
    return bool(explained > atlas.levels.explained and large)


def _beside(atlas: AtlasState, of) -> _Beside:
    """The samples that are not ``of`` (n,) a half beside the surface of those that are."""
    pool, others = atlas.pool, np.flatnonzero(~of)
    std, count = atlas.sample_std, len(pool)
    distance, normal = np.zeros(count), np.zeros((count, 3))
    columns = pool.points[of], pool.normals[of], pool.across[of]
    stds = atlas.sample_stds
    half = contour_samples(*columns, stds[of].min(), atlas.levels, stds[of], pool.contours[of])
    found, known = body_of_one(half).at(pool.points[others])
    # Where the half says much less than a sample does, it tells nothing.
    known &= found.deviation <= _VAGUE * std
    deviation = np.hypot(found.deviation, stds[others])[known]
    distance[others[known]] = found.distance[known] / deviation
    normal[others[known]] = found.normal[known] / deviation[:, None]
    return _Beside(distance, normal)


def _shift(beside: _Beside, order, before: float, after: float, moments):
    """The shift (3,) that explains most of the squared distances of samples, and the fraction that
    it explains: by ``before`` of itself in earlier samples and ``after`` in later ones."""
    square = float(beside.distance @ beside.distance)
    best, shift = 0.0, np.zeros(3)
    for moment in moments:
        signed = np.where(order < moment, before, after)[:, None] * beside.normal
        trial = np.linalg.lstsq(signed, beside.distance, rcond=None)[0]
        rest = beside.distance - signed @ trial
        explained = 1.0 - float(rest @ rest) / max(square, np.finfo(float).tiny)
        if explained > best:
            best, shift = explained, trial
    return shift, best
