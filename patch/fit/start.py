"""Where a fit starts: samples of contours around points, their tangents there, first frames.

Everything is for a stack of m patches at once; one patch is a stack of one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from touchatlas.patch.geometry.arrays import cross, frozen_array
from touchatlas.patch.geometry.contour import Contour, ContourEnd

_LEAST_POINTS = 5
# Beyond these the surface was seen to stop or to break: the patch need not end before them.
_EDGE, _LOST, _UNREACHABLE = ContourEnd.EDGE, ContourEnd.LOST_CONTACT, ContourEnd.UNREACHABLE
_PARALLEL = 1e-9
_ROUNDING = np.finfo(float).eps
# Cosine to the normal below which rounding, not the caller, would choose the outer side.
_TANGENT = 1e-9
# Of the system for the principal curvatures: reached by sections within about 2 degrees.
_WORST_CONDITION = 1e3


class UnfitError(ValueError):
    """Contours that determine no patch: too few, too short or too alike."""


@dataclass(frozen=True, eq=False)
class Stack:
    """m fits under way, each in a frame whose normal is about right.

    Parameters
    ----------
    origin : (m, 3) float, length, world
    axes : (m, 3, 3) float, world
    offsets : (m, n, 3) float, length, world
        Samples minus origin.
    across : (m, n, 3) float, unit, world
        Normal of the plane that each sample was tracked in, and is noisy in; zero for a sample
        of no plane.
    weight : (m, n) float
        0 for what only fills the stack.
    reach : (m,) float, length
        How far around the point is known, at first; the patch radius, in the end.
    noise : (m,) float, length
    condition : (m,) float
        Of the sections, for the principal curvatures: see ``curvatures_from_sections``.
    """

    origin: np.ndarray
    axes: np.ndarray
    offsets: np.ndarray
    across: np.ndarray
    weight: np.ndarray
    reach: np.ndarray
    noise: np.ndarray
    condition: np.ndarray

    def scaled(self) -> np.ndarray:
        """(m, n, 3) samples in the frame, over the reach."""
        return self.offsets @ (self.axes / self.reach[:, None, None]).transpose(0, 2, 1)

    def __getitem__(self, rows) -> "Stack":
        """Some of them."""
        return Stack(*(getattr(self, field.name)[rows] for field in fields(self)))


def start_stack(points, contour_sets: Sequence[tuple[Contour, ...]], outwards) -> Stack:
    """The beginning of m fits from contours tracked through m points (m, 3).

    Raises
    ------
    UnfitError
        Fewer than three contours, or one with fewer than five points, or sections in fewer
        than three distinct directions.
    ValueError
        Points or outwards not finite or of a wrong shape, or an outward that is tangent.
    """
    points = frozen_array(points, (len(contour_sets), 3), "reference points")
    outwards = frozen_array(outwards, (len(contour_sets), 3), "outward vectors")
    flat, sections, counts = _even(contour_sets)
    samples, planes, present = _in_planes(flat, counts)
    most = len(flat) // len(points)
    shape = (len(points), most)
    repeats = np.arange(most) >= np.array(sections)[:, None]
    present.reshape(*shape, -1)[repeats] = 0.0
    offsets = samples.reshape(*shape, -1, 3) - points[:, None, None]
    square = np.einsum("mcni,mcni->mcn", offsets, offsets)
    counts = counts.reshape(shape)
    tangents = _chord_tangents(offsets, square, counts)
    noise = np.array([c.noise_std for c in flat]).reshape(shape)
    tangents[repeats], noise[repeats] = 0.0, 0.0
    axes, condition = _first_axes(tangents, outwards)
    reach = _extents(square, counts, flat)
    # A contour that ends at its point within rounding shows nothing around it.
    reach = np.where(reach**2 <= _ROUNDING * square.max(axis=(1, 2)), 0.0, reach)
    return Stack(
        points,
        axes,
        offsets.reshape(len(points), -1, 3),
        np.repeat(planes.reshape(*shape, 3), samples.shape[1], axis=1),
        present.reshape(len(points), -1),
        reach,
        np.sqrt((noise * noise).sum(axis=1) / sections),
        condition,
    )


def _even(contour_sets) -> tuple[list[Contour], list[int], np.ndarray]:
    """The contours of all patches, as many of each; how many each has, and their points (f,).

    A patch with fewer than others has its last one twice: to be left without weight.
    """
    sections = [len(contours) for contours in contour_sets]
    if min(sections) < 3:
        raise UnfitError(
            f"{min(sections)} sections were given; principal curvatures need 3 or more"
        )
    flat = [s[min(i, len(s) - 1)] for s in contour_sets for i in range(max(sections))]
    counts = np.array([len(c.points) for c in flat])
    if counts.min() < _LEAST_POINTS:
        raise UnfitError(
            f"a contour has {counts.min()} points; a section fit needs "
            f"{_LEAST_POINTS} or more: sample more finely or track further"
        )
    return flat, sections, counts


def _in_planes(flat: list[Contour], counts):
    """Samples (f, n, 3) of contours, put back into their planes; the planes' normals (f, 3), and
    which samples do not only fill the lines (f, n)."""
    samples, present = _padded(flat, counts)
    # Off its plane a sample tells nothing: it was tracked in it.
    planes = np.array([c.plane.normal for c in flat])
    anchors = np.array([c.plane.point for c in flat])
    off = np.einsum("fni,fi->fn", samples - anchors[:, None], planes)
    return samples - off[..., None] * planes[:, None], planes, present


def contour_extent(point, contours) -> float:
    """Distance from the point to the nearest soft end of a contour: how far around is known.

    Hard ends (an edge, lost contact) do not count. Where there are no others the whole face was
    touched, up to the farthest of them.
    """
    ends = np.array([[contour.points[0], contour.points[-1]] for contour in contours]) - point
    counts = np.full((1, len(contours)), 2)
    return float(_extents((ends * ends).sum(axis=2)[None], counts, contours)[0])


def _padded(flat: list[Contour], counts):
    """Points (f, n, 3) of contours filled up to one length, and which of them are (f, n)."""
    most = counts.max()
    if counts.min() == most:
        return np.array([c.points for c in flat]), np.ones((len(flat), most))
    samples = np.array(
        [
            np.concatenate([c.points, np.repeat(c.points[-1:], most - len(c.points), axis=0)])
            for c in flat
        ]
    )
    return samples, (np.arange(most) < counts[:, None]).astype(float)


def _chord_tangents(offsets, square, counts):
    """(m, c, 3) unit directions of curves where they pass nearest to the origin: chords over
    half of each, so that noise turns them little."""
    half = np.maximum(2, counts // 4)
    middle = np.minimum(np.maximum(square.argmin(axis=2), half), counts - 1 - half)
    rows, columns = np.arange(counts.shape[0])[:, None], np.arange(counts.shape[1])
    chord = offsets[rows, columns, middle + half] - offsets[rows, columns, middle - half]
    length = np.sqrt(np.einsum("mci,mci->mc", chord, chord))
    return chord / np.maximum(length, np.finfo(float).tiny)[..., None]


def _extents(square, counts, flat) -> np.ndarray:
    """(m,) distances to the nearest soft ends, or to the farthest end where all are hard, from
    squared distances (m, c, n)."""
    ends = np.stack([square[..., 0], np.take_along_axis(square, counts[..., None] - 1, 2)[..., 0]])
    hard = [[e is _EDGE or e is _LOST or e is _UNREACHABLE for e in c.ends] for c in flat]
    nearest = ends.min(axis=(0, 2))
    if any(map(any, hard)):
        is_hard = np.array(hard).reshape(*counts.shape, 2).transpose(2, 0, 1)
        soft = np.where(is_hard, np.inf, ends).min(axis=(0, 2))
        nearest = np.where(np.isfinite(soft), soft, ends.max(axis=(0, 2)))
    return np.sqrt(nearest)


def _first_axes(tangents, outwards):
    """Axes (m, 3, 3) whose normal is most nearly orthogonal to all tangents (m, c, 3); those
    that are zero do not count.

    The paper, section 2.1; see ``normal_from_tangents``. Also the condition number (m,) of the
    sections.
    """
    values, vectors = np.linalg.eigh(tangents.transpose(0, 2, 1) @ tangents)
    if (values[:, 1] <= _PARALLEL * values[:, 2]).any():
        raise UnfitError(
            "all sections have the same tangent; track at least two more in other planes"
        )
    axes = np.empty_like(vectors)
    axes[:, 0], axes[:, 2] = vectors[:, :, 2], vectors[:, :, 0]
    side = (axes[:, 2] * outwards).sum(axis=1)
    axes[:, 2] *= np.where(side < 0.0, -1.0, 1.0)[:, None]
    axes[:, 1] = cross(axes[:, 2], axes[:, 0])
    x, y = (axes[:, :2] @ tangents.transpose(0, 2, 1)).transpose(1, 0, 2)
    design = np.empty((*x.shape, 3))
    square = np.maximum(x * x + y * y, np.finfo(float).tiny)
    design[..., 0], design[..., 1] = square > np.finfo(float).tiny, (x * x - y * y) / square
    design[..., 2] = 2.0 * x * y / square
    squares = np.linalg.eigvalsh(design.transpose(0, 2, 1) @ design)
    condition = np.sqrt(squares[:, 2] / np.maximum(squares[:, 0], _ROUNDING**2 * squares[:, 2]))
    if condition.max() > _WORST_CONDITION:
        raise UnfitError(
            "the sections have fewer than three distinct directions (condition "
            f"{condition.max():.3g}); choose sampling planes about 60 degrees apart"
        )
    if (np.abs(side) <= _TANGENT * np.abs(outwards).max(axis=1)).any():
        raise ValueError(
            "outward is zero or tangent to the surface and tells no side; give one that points out"
        )
    # Along the first section: rounding would choose the eigenvectors of even ones.
    angle = np.arctan2(y[:, 0], x[:, 0])
    axes[:, 0] = np.cos(angle)[:, None] * axes[:, 0] + np.sin(angle)[:, None] * axes[:, 1]
    axes[:, 1] = cross(axes[:, 2], axes[:, 0])
    return axes, condition
