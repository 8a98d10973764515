"""Recorded curves made ready for a fit: reference point, arcs around it, planes and noise."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.curvature import normal_from_tangents
from touchatlas.sim.recorded.arcs import binding_ends, near_arc, this_side
from touchatlas.sim.recorded.contour_file import LEAST_POINTS, Curve
from touchatlas.sim.recorded.curve_offsets import check_order, offset_deviation
from touchatlas.sim.recorded.noise_estimate import estimate_noise

# Least ratio of the second to the first eigenvalue of the scatter of directions: below it they
# lie within about 5 degrees of each other. Twice as much refuses curves within about 7 degrees.
_PARALLEL = 0.01
# A curve that misses the reference point by more than this fraction of its size does not run
# through it. Twice as much accepts curves of another place.
_ASTRAY = 0.25
# Curves are flagged that miss the point, or their plane, by more than so many deviations of the
# noise and more than this fraction of their size. Twice as much flags only gross errors.
_MANY_DEVIATIONS = 4.0
_SMALL_FRACTION = 0.01
# Samples of each curve, at most, among which the start of the meeting point is sought. Doubled, the
# search takes twice as long and starts half as far from the point.
_STARTS = 1000


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
        Doubts about the curves, as keys of ``fit_report.MEANING``.
    """

    names: tuple[str, ...]
    contours: tuple[Contour, ...]
    scattered: np.ndarray
    point: np.ndarray
    flags: tuple[str, ...]


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
    point = _meeting(long) if point is None else _checked(point, long)
    arcs = [(curve, *near_arc(curve.points, point)) for curve in long]
    arcs = [arc for arc in arcs if len(arc[1]) >= LEAST_POINTS]
    near = f" near {_written(point)}, before they turn by 45 degrees or run over an edge"
    _check_count(arcs, curves, near)
    normals = _plane_normals([p for _, p, _ in arcs], [curve.normal for curve, *_ in arcs])
    flags = [] if noise is not None else ["noise estimated"]
    estimated = estimate_noise([p for _, p, _ in arcs], normals)
    noise = estimated if noise is None else noise
    for curve, p, _ in arcs:
        check_order(curve.name, p, noise)
    sections = [
        (curve, normal, *this_side(p, normal, noise, point, ends))
        for (curve, p, ends), normal in zip(arcs, normals, strict=True)
    ]
    sections = [section for section in sections if len(section[2]) >= LEAST_POINTS]
    _check_count(sections, curves, near)
    used = [curve for curve, *_ in sections]
    ends = binding_ends(point, [p for *_, p, _ in sections], [e for *_, e in sections])
    contours = tuple(
        Contour(p, SamplingPlane(p.mean(axis=0), normal), noise, e)
        for (_, normal, p, _), e in zip(sections, ends, strict=True)
    )
    flags += _doubts(point, contours)
    # Noise that was stated too small is no offset.
    if offset := offset_deviation(point, contours, max(noise, estimated)):
        flags += [] if "curves do not meet" in flags else ["curves do not meet"]
        contours = _with_offset(contours, offset)
    # A curve that starts beside the point only to run over an edge is not of this face.
    seen = [curve for curve, *_ in arcs]
    rest = [curve.points for curve in curves if curve not in seen]
    scattered = _near_contacts(point, contours, rest)
    return Recording(tuple(c.name for c in used), contours, scattered, point, tuple(flags))


def meeting_point(curves) -> np.ndarray:
    """(3,) point nearest to all curves (n, 3) in least squares, taken as polylines.

    Starts at the best of some samples and goes on by Gauss-Newton, each curve a line near its foot.

    >>> x = np.linspace(-1.0, 2.0, 7)[:, None]
    >>> curves = [x * [1.0, 0, 0], x * [0, 1.0, 0], x * [0.6, 0.8, 0] + [0, 0, 0.3]]
    >>> meeting_point(curves).round(6) + 0.0
    array([0. , 0. , 0.1])
    """
    samples = np.concatenate([curve[:: 1 + len(curve) // _STARTS] for curve in curves])
    total = sum(cKDTree(curve).query(samples)[0] ** 2 for curve in curves)
    point = samples[np.argmin(total)]
    for _ in range(20):
        feet, tangents = zip(*(_foot(curve, point) for curve in curves), strict=True)
        across = len(curves) * np.eye(3) - np.array(tangents).T @ np.array(tangents)
        step = (np.array(feet) - point).sum(axis=0)
        point = point + np.linalg.lstsq(across, step, rcond=1e-6)[0]
    return point


def _foot(curve, point):
    """Nearest point of a polyline (n, 3), and the direction of its segment there."""
    chord = np.diff(curve, axis=0)
    square = (chord * chord).sum(axis=1)
    fraction = np.clip(((point - curve[:-1]) * chord).sum(axis=1) / square, 0.0, 1.0)
    feet = curve[:-1] + fraction[:, None] * chord
    nearest = int(((feet - point) ** 2).sum(axis=1).argmin())
    return feet[nearest], chord[nearest] / np.sqrt(square[nearest])


def _plane_normals(points, given) -> np.ndarray:
    """(c, 3) unit normals of the curves' planes: given, fitted, or holding the surface normal."""
    parts = [np.linalg.svd(p - p.mean(axis=0), full_matrices=False)[1:] for p in points]
    directions = np.array([vectors[0] for _, vectors in parts])
    spread = np.linalg.eigvalsh(directions.T @ directions)
    if spread[1] < _PARALLEL * spread[2]:
        raise ValueError(
            "all curves run in nearly one direction; record at least two more in planes about "
            "60 degrees apart"
        )
    upward = normal_from_tangents(directions, np.ones(3))
    upright = cross(directions, upward)
    upright /= np.sqrt((upright**2).sum(axis=1, keepdims=True))
    normals = []
    for (size, vectors), across, known in zip(parts, upright, given, strict=True):
        bent = size[1] > 3.0 * size[2] and size[1] > 1e-9 * size[0]
        normals.append(known if known is not None else vectors[2] if bent else across)
    return np.array(normals)


def _with_offset(contours, offset: float):
    """Contours of which each may be displaced: what all its points share is no smaller in their
    mean, so it counts as noise that is larger by the root of their number."""
    return tuple(
        replace(c, noise_std=float(np.hypot(c.noise_std, offset * np.sqrt(len(c.points)))))
        for c in contours
    )


def _doubts(point, contours) -> list[str]:
    """Flags for curves that are not plane sections through one point."""
    flags = []
    reach = max(float(np.ptp(c.points, axis=0).max()) for c in contours)
    noise = contours[0].noise_std
    slack = max(_MANY_DEVIATIONS * noise, _SMALL_FRACTION * reach)
    if any(np.sqrt(((_foot(c.points, point)[0] - point) ** 2).sum()) > slack for c in contours):
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


def _checked(point, curves) -> np.ndarray:
    """A reference point that the user gave, near the curves."""
    samples = np.concatenate([curve.points for curve in curves])
    # np.hypot does not overflow for the largest numbers allowed.
    away = float(np.hypot.reduce(samples - point, axis=1).min())
    size = min(float(np.ptp(curve.points, axis=0).max()) for curve in curves)
    if not away <= _ASTRAY * size:
        raise ValueError(
            f"the point {_written(point)} is {away:.4g} away from all curves; give a point on "
            "them, or leave it out"
        )
    return np.asarray(point, dtype=float)


def _meeting(curves: list[Curve]) -> np.ndarray:
    """Where the curves meet, no farther from any than they may miss each other."""
    point = meeting_point([curve.points for curve in curves])
    size = max(float(np.ptp(curve.points, axis=0).max()) for curve in curves)
    for curve in curves:
        away = float(np.sqrt(((_foot(curve.points, point)[0] - point) ** 2).sum()))
        if away > _ASTRAY * size:
            raise ValueError(
                f"curve {curve.name!r} passes {away:.4g} away from {_written(point)}, the point "
                "nearest to all curves; record curves through one point, or leave this one out"
            )
    return point


def _check_count(sections, curves: list[Curve], where: str) -> None:
    if len(sections) < 3:
        number = ("no curve has", "only 1 curve has", "only 2 curves have")[len(sections)]
        counts = ", ".join(f"{curve.name or 'scattered'}: {len(curve.points)}" for curve in curves)
        raise ValueError(
            f"{number} {LEAST_POINTS} or more distinct points{where} ({counts}); "
            "a patch needs three such curves through one point"
        )


def _written(point) -> str:
    return ",".join(f"{x:.4g}" for x in point)
