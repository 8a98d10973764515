"""Recorded curves made ready for a fit: reference point, arcs around it, planes and noise."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.fit.curve_noise import estimate_noise
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.curvature import normal_from_tangents
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.arcs import binding_ends, near_arc, this_side
from touchatlas.sim.recorded.curve_errors import (
    check_order,
    miss_deviation,
    offset_deviation,
)
from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.reference_point import checked_point, common_point, foot, written


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded curves around one reference point, ready for a fit.

    Parameters
    ----------
    names : tuple of str
        Of the contours.
    contours : tuple of Contour
        Three or more, cut where they have turned by 45 degrees from the reference point, or
        run over an edge.
    scattered : (s, 3) float, length, world
        Contacts that belong to no contour.
    point : (3,) float, length, world
        Reference point.
    flags : tuple of str
        Doubts about the curves, as keys of ``fit_flags.MEANING``.
    noise_std : float, length
        Of each coordinate, as stated or estimated.
    displacement_std : float, length
        Standard deviation of each coordinate of the displacement that a curve may have as a whole;
        0 where the curves meet.
    """

    names: tuple[str, ...]
    contours: tuple[Contour, ...]
    scattered: np.ndarray
    point: np.ndarray
    flags: tuple[str, ...]
    noise_std: float
    displacement_std: float = 0.0

    @property
    def all_points(self) -> np.ndarray:
        """(n, 3) samples of all contours, then the scattered contacts, length, world."""
        return np.concatenate([*(c.points for c in self.contours), self.scattered])


def prepare(curves: list[Curve], noise: float | None = None, point=None) -> Recording:
    """Contours around a reference point from recorded curves, ready for ``fit_patch``.

    A curve's plane, where it is not given, is fitted to its points; a straight curve has none
    of its own and takes the one that holds the surface normal.

    Parameters
    ----------
    curves : list of Curve
        Those without a name, or too short for a section, are scattered contacts.
    noise : float, length, optional
        Standard deviation of each coordinate; estimated from the curves where None.
    point : (3,) float, length, world, optional
        Reference point; the point nearest to all curves where None.

    Raises
    ------
    ValueError
        Fewer than three curves with five points around the reference point, all in one
        direction, or a reference point far from them; noise that is no length.
    """
    long = _long_curves(curves, noise)
    point = common_point(long) if point is None else checked_point(point, long)
    arcs = [(curve, *near_arc(curve.points, point)) for curve in long]
    arcs = [arc for arc in arcs if len(arc[1]) >= LEAST_POINTS]
    near = f" near {written(point)}, before they turn by 45 degrees or run over an edge"
    _check_count(arcs, curves, near)
    normals = _plane_normals([p for _, p, _ in arcs], [curve.normal for curve, *_ in arcs])
    flags = [] if noise is not None else ["noise estimated"]
    estimated = estimate_noise([p for _, p, _ in arcs], normals)
    noise = estimated if noise is None else noise
    for curve, p, _ in arcs:
        check_order(curve.name, p, noise)
    sections = _sections(arcs, normals, noise, point)
    _check_count(sections, curves, near)
    contours = _contours(sections, noise, point)
    flags += _flags(point, contours)
    # Noise that was stated too small is no offset.
    spread = offset_deviation(point, contours, max(noise, estimated))
    if spread and "curves do not meet" not in flags:
        flags.append("curves do not meet")
    if "curves do not meet" in flags:
        spread = max(spread, miss_deviation(contours))
    # A curve that runs over an edge near the point is not of this face.
    seen = [curve for curve, *_ in arcs]
    rest = [curve.points for curve in curves if curve not in seen]
    scattered = _near_contacts(point, contours, rest)
    return Recording(
        tuple(curve.name for curve, *_ in sections),
        contours,
        scattered,
        point,
        tuple(flags),
        noise,
        spread,
    )


def _long_curves(curves: list[Curve], noise: float | None) -> list[Curve]:
    """The curves that are long enough for a section, and at least as long as a given noise."""
    if noise is not None and not (np.isfinite(noise) and noise >= 0.0):
        raise ValueError(f"noise is {noise}; give a length >= 0, or leave it out to estimate it")
    long = [curve for curve in curves if curve.name and len(curve.points) >= LEAST_POINTS]
    _check_count(long, curves, "")
    for curve in long:
        check_order(curve.name, curve.points, np.inf)
    span = max(float(np.ptp(curve.points, axis=0).max()) for curve in long)
    if noise is not None and noise > span:
        raise ValueError(
            f"noise is {noise:g}, but the curves are only {span:.4g} long; give a smaller one, or "
            "leave it out to estimate it"
        )
    return long


def _sections(arcs, normals, noise: float, point) -> list:
    """Curve, plane normal, points and ends of each arc on the point's side of all edges."""
    sections = [
        (curve, normal, *this_side(p, normal, noise, point, ends))
        for (curve, p, ends), normal in zip(arcs, normals, strict=True)
    ]
    return [section for section in sections if len(section[2]) >= LEAST_POINTS]


def _contours(sections, noise: float, point) -> tuple[Contour, ...]:
    """The contours of sections, each with its ends that bind the patch."""
    ends = binding_ends(point, [p for *_, p, _ in sections], [e for *_, e in sections])
    return tuple(
        Contour(p, SamplingPlane(p.mean(axis=0), normal), noise, e)
        for (_, normal, p, _), e in zip(sections, ends, strict=True)
    )


def _plane_normals(points, given) -> np.ndarray:
    """(c, 3) unit normals of the curves' planes: given, fitted, or holding the surface normal."""
    parts = [np.linalg.svd(p - p.mean(axis=0), full_matrices=False)[1:] for p in points]
    directions = np.array([vectors[0] for _, vectors in parts])
    spread = np.linalg.eigvalsh(directions.T @ directions)
    # Eigenvalues: directions within about 5 degrees of each other.
    if spread[1] < 0.01 * spread[2]:
        raise ValueError(
            "all curves run in nearly one direction; record at least two more in planes about "
            f"60 degrees apart{_stretched(np.concatenate(points))}; `touchatlas learn` takes any "
            "curves"
        )
    upward = normal_from_tangents(directions, np.ones(3))
    upright = cross(directions, upward)
    upright /= np.sqrt((upright**2).sum(axis=1, keepdims=True))
    normals = []
    for (size, vectors), across, known in zip(parts, upright, given, strict=True):
        bent = size[1] > 3.0 * size[2] and size[1] > 1e-9 * size[0]
        normals.append(known if known is not None else vectors[2] if bent else across)
    return np.array(normals)


def _stretched(points) -> str:
    """What else may be wrong: one coordinate spans far more than both others."""
    span = np.ptp(points, axis=0)
    low, middle, high = np.argsort(span)
    if span[high] < 30.0 * span[middle]:
        return ""
    times = span[high] / span[middle]
    return (
        f", or see whether {'xyz'[high]} has another unit: it spans {times:.3g} times as much as "
        f"{'xyz'[min(low, middle)]} and {'xyz'[max(low, middle)]}"
    )


def _flags(point, contours) -> list[str]:
    """Flags for curves that are not plane sections through one point."""
    flags = []
    reach = max(float(np.ptp(c.points, axis=0).max()) for c in contours)
    noise = contours[0].noise_std
    # What noise, or one percent of the longest curve, explains.
    slack = max(4.0 * noise, 0.01 * reach)
    if any(np.sqrt(((foot(c.points, point)[0] - point) ** 2).sum()) > slack for c in contours):
        flags.append("curves do not meet")
    # Medians, which single bad contacts hardly change.
    off = [1.5 * np.median(np.abs((c.points - c.plane.point) @ c.plane.normal)) for c in contours]
    if max(off) > slack:
        flags.append("curves not planar")
    ends = [end for c in contours for end in c.ends]
    if ContourEnd.TURNED_AWAY in ends:
        flags.append("curves cut")
    if ContourEnd.EDGE in ends:
        flags.append("edge crossed")
    if ContourEnd.UNREACHABLE in ends:
        flags.append("one-sided curves")
    return flags


def _near_contacts(point, contours, rest) -> np.ndarray:
    """(s, 3) contacts no farther from the point than the contours reach: others are of some
    other part of the surface."""
    points = np.concatenate([np.zeros((0, 3)), *rest])
    reach = max(float(((c.points - point) ** 2).sum(axis=1).max()) for c in contours)
    return points[((points - point) ** 2).sum(axis=1) <= reach]


def _check_count(sections, curves: list[Curve], where: str) -> None:
    if len(sections) < 3:
        number = ("no curve has", "only 1 curve has", "only 2 curves have")[len(sections)]
        counts = ", ".join(f"{curve.name or 'scattered'}: {len(curve.points)}" for curve in curves)
        raise ValueError(
            f"{number} {LEAST_POINTS} or more distinct points{where} ({counts}); "
            "a patch needs three such curves through one point; `touchatlas learn` takes any curves"
        )
