"""The start of a fit: samples about the reference point, a first frame and the reach."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import cross, frozen_array
from touchatlas.patch.geometry.contour import Contour, ContourEnd, check_contours
from touchatlas.patch.geometry.curvature import LEAST_ANGLE, WORST_CONDITION
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.patch.words import count_of

# Hard ends: the surface was seen to stop or to break there, so they do not limit the patch.
_HARD_ENDS = frozenset(
    {ContourEnd.EDGE, ContourEnd.LOST_CONTACT, ContourEnd.UNREACHABLE, ContourEnd.OVERLOAD}
)
# Rounding of one number, relative.
_ROUNDING = np.finfo(float).eps


class UnfitError(ValueError):
    """Contours that determine no patch: too few, too short or too alike."""


@dataclass(frozen=True, eq=False)
class Stack:
    """The samples of a fit in a frame whose normal is approximately right, as arrays of one row.

    Parameters
    ----------
    origin : (1, 3) float, length, world
    axes : (1, 3, 3) float, world
    offsets : (1, n, 3) float, length, world
        Samples minus origin.
    across : (1, n, 3) float, unit, world
        Normal of the plane that each sample was tracked in; its noise lies in that plane. Zero
        for a sample of no plane.
    weight : (1, n) float
        Variance of the stack's noise over that of the sample; 0 for entries that only pad the
        arrays.
    reach : (1,) float, length
        At the start: how far the contours run around the point. At the end: the patch radius.
    noise : (1,) float, length
        Standard deviation of the noise of samples.
    condition : (1,) float
        Condition number of the sections: see ``curvatures_from_sections``.
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
        """(1, n, 3) samples in the frames, over the reach."""
        return self.offsets @ (self.axes / self.reach[:, None, None]).transpose(0, 2, 1)


def start_stack(point, contours: tuple[Contour, ...], outward) -> Stack:
    """The start of one fit, from contours tracked through a point (3,).

    Raises
    ------
    UnfitError
        Fewer than three contours, or one with fewer than five points, or sections in fewer
        than three distinct directions.
    ValueError
        A point or outward that is not finite or of a wrong shape, or an outward that is tangent.
    """
    point = frozen_array(point, (3,), "reference point")
    outward = frozen_array(outward, (3,), "outward vector")
    check_contours(contours)
    _check_counts(contours)
    offsets = [_fitted_points(contour) - point for contour in contours]
    reach = _reach(offsets, contours)
    tangents = np.array([_chord_tangent(o) for o in offsets])
    axes, condition = _first_axes(tangents, outward)
    normals = np.array([c.plane.normal for c in contours])
    stds = [c.noise_std for c in contours]
    # Nearer than five deviations the probe may not have moved.
    if reach < 5.0 * min(stds):
        _check_that_it_moved(offsets, reach)
    # Contours are padded to one length: rounding of all later sums follows from this order.
    index = np.arange(max(len(o) for o in offsets))
    padded = [o[np.minimum(index, len(o) - 1)] for o in offsets]
    weight = np.concatenate([index < len(o) for o in offsets]).astype(float)
    noise, weights = _noise_and_weights(np.array(stds))
    if weights is not None:
        weight *= np.repeat(weights, len(index))
    return Stack(
        point[None],
        axes[None],
        np.concatenate(padded)[None],
        np.repeat(normals, len(index), axis=0)[None],
        weight[None],
        np.array([reach]),
        np.array([noise]),
        np.array([condition]),
    )


def _check_that_it_moved(offsets, reach: float) -> None:
    """UnfitError for a contour that wanders about one place: it shows noise alone."""
    for points in offsets:
        steps = points[1:] - points[:-1]
        path = np.sqrt((steps * steps).sum(axis=1)).sum()
        chord = points[-1] - points[0]
        # An arc of 180 degrees has 0.6, 19 samples of noise have 0.1.
        if np.sqrt(chord @ chord) < 0.3 * path:
            raise UnfitError(
                f"a contour ends {reach:.3g} from the reference point and wanders about it, so it "
                "shows noise alone; track further to both sides"
            )


def _noise_and_weights(stds) -> tuple[float, np.ndarray | None]:
    """Noise that stands for all contours of noise (c,), and their weights (c,), None where equal.

    1/s^2 is the mean of 1/s_i^2, and the weights are s^2/s_i^2 (generalised least squares).
    """
    variance = stds * stds
    if (variance == variance[0]).all():
        return float(np.sqrt(variance.sum() / len(stds))), None
    # An exact contour among noisy ones would make the normal equations singular.
    variance = np.maximum(variance, 1e-6 * variance.max())
    joint = 1.0 / np.mean(1.0 / variance)
    return float(np.sqrt(joint)), joint / variance


def _fitted_points(contour: Contour) -> np.ndarray:
    """(n, 3) points projected to the sampling plane, where a distance from it is noise; those with
    normals are points of the surface beside it."""
    if contour.normals is not None:
        return contour.points
    off = np.einsum("ni,i->n", contour.points - contour.plane.point, contour.plane.normal)
    return contour.points - off[:, None] * contour.plane.normal


def _check_counts(contours) -> None:
    """UnfitError for too few contours, or points of one."""
    if len(contours) < 3:
        raise UnfitError(
            f"{len(contours)} sections were given; principal curvatures need 3 or more"
        )
    fewest = min(len(contour.points) for contour in contours)
    if fewest < LEAST_POINTS:
        raise UnfitError(
            f"a contour has {count_of(fewest, 'point')}; a section fit needs "
            f"{LEAST_POINTS} or more: sample more finely or track further"
        )


def _chord_tangent(offsets) -> np.ndarray:
    """(3,) unit direction of a curve where it passes nearest to the origin.

    It is a chord over half of the samples, so that noise hardly rotates it.
    """
    half = max(2, len(offsets) // 4)
    nearest = int(np.einsum("ni,ni->n", offsets, offsets).argmin())
    middle = min(max(nearest, half), len(offsets) - 1 - half)
    chord = offsets[middle + half] - offsets[middle - half]
    return chord / max(np.sqrt(np.einsum("i,i", chord, chord)), np.finfo(float).tiny)


def _reach(offsets, contours) -> float:
    """Distance to the nearest soft end, or to the farthest end where all are hard.

    It is zero where a contour ends at the point within rounding: it shows nothing around it.
    """
    squares = np.array([np.einsum("ni,ni->n", o[[0, -1]], o[[0, -1]]) for o in offsets])
    soft = np.array([[end not in _HARD_ENDS for end in c.ends] for c in contours])
    square = squares[soft].min() if soft.any() else squares.max()
    farthest = max(np.einsum("ni,ni->n", o, o).max() for o in offsets)
    return 0.0 if square <= _ROUNDING * farthest else float(np.sqrt(square))


def _first_axes(tangents, outward) -> tuple[np.ndarray, float]:
    """Axes (3, 3) whose normal minimises sum (N . T)^2 over tangents (c, 3), and the condition.

    The paper, section 2.1; see ``normal_from_tangents``. The first axis is along the first
    tangent, because rounding would choose among the eigenvectors of evenly spread ones.
    """
    values, vectors = np.linalg.eigh(tangents.T @ tangents)
    if values[1] <= LEAST_ANGLE * values[2]:
        raise UnfitError(
            "all sections have the same tangent; track at least two more in other planes"
        )
    normal = vectors[:, 0]
    side = (normal * outward).sum()
    if side < 0.0:
        normal = -normal
    e1 = vectors[:, 2]
    e2 = cross(normal, e1)
    x, y = np.stack([e1, e2]) @ tangents.T
    condition = _condition_of_sections(x, y)
    if abs(side) <= LEAST_ANGLE * np.abs(outward).max():
        raise ValueError(
            "outward is zero or tangent to the surface and tells no side; give one that points out"
        )
    angle = np.arctan2(y[0], x[0])
    e1 = np.cos(angle) * e1 + np.sin(angle) * e2
    return np.stack([e1, cross(normal, e1), normal]), condition


def _condition_of_sections(x, y) -> float:
    """Condition number of Euler's system for tangents x, y (c,); UnfitError if it is too large."""
    square = np.maximum(x * x + y * y, np.finfo(float).tiny)
    design = np.empty((len(x), 3))
    design[:, 0], design[:, 1] = 1.0, (x * x - y * y) / square
    design[:, 2] = 2.0 * x * y / square
    values = np.linalg.eigvalsh(design.T @ design)
    condition = float(np.sqrt(values[2] / np.maximum(values[0], _ROUNDING**2 * values[2])))
    if condition > WORST_CONDITION:
        raise UnfitError(
            "the sections have fewer than three distinct directions (condition "
            f"{condition:.3g}); choose sampling planes about 60 degrees apart"
        )
    return condition
