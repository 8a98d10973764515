"""Tangent and curvature of plane sections at a point, with their standard deviations."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.words import count_of

# Fewest points of a window: a quadratic leaves two degrees of freedom for its residual.
LEAST_POINTS = 5
# Largest angle between a section and its direction at a point on the arc about it, rad: a height
# function is accurate up to some 50 degrees.
MOST_TURN = float(np.deg2rad(50.0))


@dataclass(frozen=True, eq=False)
class SectionFit:
    """Tangent and curvature of one contour at the reference point.

    Parameters
    ----------
    tangent : (3,) float, unit, world
    curvature_vector : (3,) float, 1/length, world
        Curvature times principal normal. It points to the centre of curvature.
    curvature_std, tangent_std : float, 1/length and rad
        Standard deviations of the curvature and of the tangent's angle.
    residual_rms : float, length
        Of the points in the window about the quadratic.
    count : int
        Number of points in the window.
    """

    tangent: np.ndarray
    curvature_vector: np.ndarray
    curvature_std: float
    tangent_std: float
    residual_rms: float
    count: int


def fit_sections(point, contours, noise_std: float) -> list[SectionFit]:
    """Tangent and curvature at ``point`` of every contour, each in its own sampling plane.

    A quadratic is fitted in a window about the point, because the curve resembles its osculating
    circle (the paper, section 2.1). Wide windows are biased and narrow ones are noisy. Of four
    windows the fit uses the widest in which noise explains two numbers: the residuals, and how
    much a cubic and a quartic term would reduce them.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point on or near every contour.
    contours : sequence of Contour
        Each has five or more points.
    noise_std : float, length
        Standard deviation of each coordinate of each point; 0 is allowed.

    Returns
    -------
    list of SectionFit

    Raises
    ------
    ValueError
        A contour has fewer than five points, or they all coincide.

    Notes
    -----
    For n even samples on +-L with noise s, the inverse normal matrix of a quadratic gives the
    curvature a standard deviation of 6.71 s/(L^2 sqrt n) and the slope one of 1.73 s/(L sqrt n).
    """
    for contour in contours:
        if len(contour.points) < LEAST_POINTS:
            raise ValueError(
                f"a contour has {count_of(len(contour.points), 'point')}; a section fit needs "
                f"{LEAST_POINTS} or more: sample more finely or track further"
            )
    along, across, s, h, inside = _plane_coordinates(point, contours)
    quadratics = _windowed_quadratics(s, h, inside)
    chosen = _widest_consistent_window(quadratics, noise_std)
    return [
        _section_fit(quadratics, c, w, along[c], across[c], noise_std)
        for c, w in enumerate(chosen.tolist())
    ]


class _Quadratics(NamedTuple):
    """Least squares h = a0 + a1 s + a2 s^2 of m contours in each of w windows.

    coefficients (m, w, 3); inverse normal matrices (m, w, 3, 3); residual rms (m, w), length;
    counts (m, w); and gain (m, w), length^2: the squared residuals that orders 3 and 4 would
    remove.
    """

    coefficients: np.ndarray
    inverse: np.ndarray
    rms: np.ndarray
    counts: np.ndarray
    gain: np.ndarray


def _section_fit(quadratics: _Quadratics, c: int, w: int, along, across, noise_std) -> SectionFit:
    """The section of contour c in window w: k = h'' / (1 + h'^2)^(3/2) at s = 0."""
    slope, half_curvature = quadratics.coefficients[c, w, 1:]
    inverse, rms = quadratics.inverse[c, w], quadratics.rms[c, w]
    squared_length = 1.0 + slope * slope
    spread = max(noise_std, rms)
    tangent = (along + slope * across) / np.sqrt(squared_length)
    normal = (across - slope * along) / np.sqrt(squared_length)
    return SectionFit(
        tangent,
        2.0 * half_curvature * squared_length**-1.5 * normal,
        float(2.0 * spread * np.sqrt(inverse[2, 2])),
        float(spread * np.sqrt(inverse[1, 1]) / squared_length),
        float(rms),
        int(quadratics.counts[c, w]),
    )


def _plane_coordinates(point, contours):
    """In-plane axes (m, 3) and coordinates s, h (m, n) of contours about the point.

    Contours are padded to one length; ``inside`` (m, n) is 0 in the padding.
    """
    m, n = len(contours), max(len(c.points) for c in contours)
    offsets, inside = np.zeros((m, n, 3)), np.zeros((m, n))
    chords, normals = np.empty((m, 3)), np.empty((m, 3))
    for c, contour in enumerate(contours):
        count = len(contour.points)
        # The plane curve of points beside the plane, which know the tangent plane.
        points = contour.points if contour.normals is None else contour.points_in_plane
        difference = points - point
        offsets[c, :count], inside[c, :count] = difference, 1.0
        # A chord over half the contour, so that noise hardly tilts the axis of the parabola.
        half = max(2, count // 4)
        middle = min(max(int((difference**2).sum(axis=1).argmin()), half), count - 1 - half)
        chords[c] = difference[middle + half] - difference[middle - half]
        normals[c] = contour.plane.normal
    chords -= (chords * normals).sum(axis=1)[:, None] * normals
    length = np.sqrt((chords**2).sum(axis=1))
    if not length.min() > 0.0:
        raise ValueError("a contour does not leave its first point; track further")
    along = chords / length[:, None]
    across = cross(normals, along)
    s = (offsets @ along[:, :, None])[..., 0]
    h = (offsets @ across[:, :, None])[..., 0]
    return along, across, s, h, inside


def _windowed_quadratics(s, h, inside) -> _Quadratics:
    """Quadratic fits of every contour in every window."""
    distance = np.where(inside > 0, np.abs(s), np.inf)
    nearest = np.sort(distance, axis=1)[:, LEAST_POINTS - 1]
    reach = np.abs(s).max(axis=1)
    # The scatter of curvature grows as the width to -5/2: each step costs a factor of about 2.4.
    width = np.maximum(np.array([1.0, 0.7, 0.5, 0.35]) * reach[:, None], nearest[:, None])
    mask = (distance[:, None, :] <= width[:, :, None] * (1 + 1e-9)).astype(float)
    # Scaled by the reach so that the normal matrix is well conditioned in any unit.
    t = s / reach[:, None]
    powers = np.empty((*t.shape, 9))
    powers[..., 0] = 1.0
    for k in range(8):
        np.multiply(powers[..., k], t, out=powers[..., k + 1])
    normal_matrix = (mask @ powers)[:, :, np.add.outer(np.arange(5), np.arange(5))]
    rhs = mask @ (powers[:, :, :5] * h[:, :, None])
    inverse = np.linalg.inv(normal_matrix[..., :3, :3])
    scaled = (inverse @ rhs[..., :3, None])[..., 0]
    counts = mask.sum(axis=2)
    sum_of_squares = (mask @ (h**2)[:, :, None])[..., 0] - (scaled * rhs[..., :3]).sum(axis=2)
    rms = np.sqrt(np.maximum(sum_of_squares, 0.0) / np.maximum(counts - 3.0, 1.0))
    gain = _gain_of_higher_orders(normal_matrix, rhs, scaled, inverse)
    unit = reach[:, None, None] ** -np.arange(3.0)
    inverse = inverse * (unit[..., None] * unit[..., None, :])
    return _Quadratics(scaled * unit, inverse, rms, counts, gain)


def _gain_of_higher_orders(normal_matrix, rhs, quadratic, inverse):
    """(m, w) squared residuals that orders 3 and 4 would remove, length^2.

    r^t S^-1 r, with the Schur complement S of the quadratic's block in the normal matrix
    (m, w, 5, 5) and the rest r of the right-hand side (m, w, 5).
    """
    mixed = normal_matrix[..., 3:, :3]
    cubic, quartic = np.moveaxis(rhs[..., 3:] - (mixed @ quadratic[..., None])[..., 0], -1, 0)
    schur = normal_matrix[..., 3:, 3:] - mixed @ inverse @ mixed.swapaxes(-1, -2)
    a, b, c = schur[..., 0, 0], schur[..., 0, 1], schur[..., 1, 1]
    determinant = np.maximum(a * c - b * b, np.finfo(float).tiny)
    return (c * cubic**2 - 2.0 * b * cubic * quartic + a * quartic**2) / determinant


def _widest_consistent_window(quadratics: _Quadratics, noise_std):
    """(m,) index of the widest window that noise explains, or of the narrowest if none is."""
    freedom = np.maximum(quadratics.counts - 3.0, 1.0)
    limit = noise_std * np.sqrt(1.0 + 5.0 * np.sqrt(2.0 / freedom))
    # Chi-square of two degrees of freedom: noise exceeds it in one of a thousand windows. The
    # narrowest window has fourteen times the scatter of the widest.
    largest_gain = -2.0 * np.log(1e-3) * noise_std**2
    consistent = (quadratics.rms <= limit) & (quadratics.gain <= largest_gain)
    consistent[:, -1] = True
    return consistent.argmax(axis=1)


def contour_normals(contour, outward) -> np.ndarray:
    """(n, 3) unit normals of a contour within its sampling plane, toward ``outward`` (3,) where the
    contour is nearest to the point of the plane, the contact.

    Each is the surface normal projected to the plane. They are computed by central differences
    over four steps, fewer at the ends. Normals that the probe measured take their place.
    """
    if contour.normals is not None:
        return np.array(contour.normals)
    points = contour.points
    index = np.arange(len(points))
    last = len(points) - 1
    chords = points[np.minimum(index + 2, last)] - points[np.maximum(index - 2, 0)]
    normals = cross(contour.plane.normal, chords)
    length = np.sqrt((normals * normals).sum(axis=1))
    normals = normals / np.where(length > 0.0, length, 1.0)[:, None]
    # The probe stays on one side of the surface, so one sign holds for the whole curve. It is that
    # at the contact: far from it the surface may face the other way.
    offset = points - contour.plane.point
    contact = (offset * offset).sum(axis=1).argmin()
    return normals if normals[contact] @ outward >= 0.0 else -normals
