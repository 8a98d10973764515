"""Plane-curve fit near a point: tangent and curvature of each section, with their deviations."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import cross

_WINDOWS = np.array([1.0, 0.7, 0.5, 0.35])
_LEAST_POINTS = 5
_HANKEL = np.add.outer(np.arange(5), np.arange(5))
# Chance that a window is given up though noise is all there is: the tail of a chi-square with
# two degrees of freedom. Far smaller, since a window of a third has fourteen times the scatter.
_FALSE_ALARM = 1e-3
_MOST_GAIN = -2.0 * np.log(_FALSE_ALARM)
# Deviations of chi-square beyond which noise does not explain the residuals.
_MOST_EXCESS = 5.0


@dataclass(frozen=True, eq=False)
class SectionFit:
    """What one contour says about the surface at the reference point.

    Parameters
    ----------
    tangent : (3,) float, unit, world
    curvature_vector : (3,) float, 1/length, world
        Curvature times principal normal: toward the centre of curvature.
    curvature_std, tangent_std : float, 1/length and rad
    residual_rms : float, length
    count : int
        Points in the window that was used.
    """

    tangent: np.ndarray
    curvature_vector: np.ndarray
    curvature_std: float
    tangent_std: float
    residual_rms: float
    count: int


def fit_sections(point, contours, noise_std: float) -> list[SectionFit]:
    """Local quadratic fit of every contour near ``point``, in its own sampling plane.

    A quadratic because the curve resembles its osculating circle (the paper, section 2.1).
    The widest of four windows in which noise explains the residuals, and what a cubic and a
    quartic term would take off them, is used: wide windows are biased, narrow ones are noisy.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point, on or near every contour.
    contours : sequence of Contour
        Each with five points or more near the reference point.
    noise_std : float, length
        Standard deviation of each coordinate of each point; 0 is allowed.

    Returns
    -------
    list of SectionFit

    Raises
    ------
    ValueError
        When a contour has fewer than five points, or goes nowhere.

    Notes
    -----
    With n even samples on +-L the curvature deviates by 6.71 s/(L^2 sqrt n), the slope by
    1.73 s/(L sqrt n), s the noise: the inverse normal matrix of a quadratic.
    """
    for contour in contours:
        if len(contour.points) < _LEAST_POINTS:
            raise ValueError(
                f"a contour has {len(contour.points)} points; a section fit needs "
                f"{_LEAST_POINTS} or more: sample more finely or track further"
            )
    along, across, s, h, inside = _plane_coordinates(point, contours)
    coefficients, inverse, rms, counts, gain = _windowed_quadratics(s, h, inside)
    chosen = _widest_consistent_window(rms, counts, gain, noise_std)
    fits = []
    for c, w in enumerate(chosen):
        slope, half_curvature = coefficients[c, w, 1:]
        stretch = 1.0 + slope * slope
        spread = max(noise_std, rms[c, w])
        tangent = (along[c] + slope * across[c]) / np.sqrt(stretch)
        normal = (across[c] - slope * along[c]) / np.sqrt(stretch)
        fits.append(
            SectionFit(
                tangent,
                2.0 * half_curvature * stretch**-1.5 * normal,
                float(2.0 * spread * np.sqrt(inverse[c, w, 2, 2])),
                float(spread * np.sqrt(inverse[c, w, 1, 1]) / stretch),
                float(rms[c, w]),
                int(counts[c, w]),
            )
        )
    return fits


def _plane_coordinates(point, contours):
    """In-plane axes (m, 3) and coordinates (m, n) of padded contours; inside marks real points."""
    m, n = len(contours), max(len(c.points) for c in contours)
    offsets, inside = np.zeros((m, n, 3)), np.zeros((m, n))
    chords, normals = np.empty((m, 3)), np.empty((m, 3))
    for c, contour in enumerate(contours):
        count = len(contour.points)
        difference = contour.points - point
        offsets[c, :count], inside[c, :count] = difference, 1.0
        # A chord over half the contour: a noisy direction would slant the parabola's axis.
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


def _windowed_quadratics(s, h, inside):
    """Least squares h = a0 + a1 s + a2 s^2 in every window: coefficients (m, w, 3), inverse
    normal matrices (m, w, 3, 3), residual rms (m, w), counts (m, w), and the squared residuals
    (m, w) that orders 3 and 4 would take off."""
    distance = np.where(inside > 0, np.abs(s), np.inf)
    nearest = np.sort(distance, axis=1)[:, _LEAST_POINTS - 1]
    reach = np.abs(s).max(axis=1)
    width = np.maximum(_WINDOWS * reach[:, None], nearest[:, None])
    mask = (distance[:, None, :] <= width[:, :, None] * (1 + 1e-9)).astype(float)
    # Scaled by the reach so that the normal matrix is well conditioned in any unit.
    t = s / reach[:, None]
    powers = np.empty((*t.shape, 9))
    powers[..., 0] = 1.0
    for k in range(8):
        np.multiply(powers[..., k], t, out=powers[..., k + 1])
    normal_matrix = (mask @ powers)[:, :, _HANKEL]
    right = mask @ (powers[:, :, :5] * h[:, :, None])
    inverse = np.linalg.inv(normal_matrix[..., :3, :3])
    scaled = (inverse @ right[..., :3, None])[..., 0]
    counts = mask.sum(axis=2)
    squares = (mask @ (h**2)[:, :, None])[..., 0] - (scaled * right[..., :3]).sum(axis=2)
    rms = np.sqrt(np.maximum(squares, 0.0) / np.maximum(counts - 3.0, 1.0))
    gain = _gain_of_higher_orders(normal_matrix, right, scaled, inverse)
    unit = reach[:, None, None] ** -np.arange(3.0)
    return scaled * unit, inverse * (unit[..., None] * unit[..., None, :]), rms, counts, gain


def _gain_of_higher_orders(normal_matrix, right, quadratic, inverse):
    """(m, w) squared residuals that orders 3 and 4 take off a quadratic, from the normal matrix
    (m, w, 5, 5) and right-hand side of all five."""
    mixed = normal_matrix[..., 3:, :3]
    # What of orders 3 and 4 a quadratic does not have.
    cubic, quartic = np.moveaxis(right[..., 3:] - (mixed @ quadratic[..., None])[..., 0], -1, 0)
    own = normal_matrix[..., 3:, 3:] - mixed @ inverse @ mixed.swapaxes(-1, -2)
    a, b, c = own[..., 0, 0], own[..., 0, 1], own[..., 1, 1]
    determinant = np.maximum(a * c - b * b, np.finfo(float).tiny)
    return (c * cubic**2 - 2.0 * b * cubic * quartic + a * quartic**2) / determinant


def _widest_consistent_window(rms, counts, gain, noise_std):
    """(m,) index of the widest window that noise explains, else the narrowest."""
    freedom = np.maximum(counts - 3.0, 1.0)
    limit = noise_std * np.sqrt(1.0 + _MOST_EXCESS * np.sqrt(2.0 / freedom))
    consistent = (rms <= limit) & (gain <= _MOST_GAIN * noise_std**2)
    consistent[:, -1] = True
    return consistent.argmax(axis=1)


def contour_normals(contour, outward) -> np.ndarray:
    """(n, 3) unit normals of a contour within its sampling plane, toward ``outward`` (3,).

    The part of the surface normal that one contour shows: all of it where the plane contains
    the surface normal. Central differences over four steps, fewer at the ends.
    """
    points = contour.points
    index = np.arange(len(points))
    last = len(points) - 1
    chords = points[np.minimum(index + 2, last)] - points[np.maximum(index - 2, 0)]
    normals = cross(contour.plane.normal, chords)
    length = np.sqrt((normals * normals).sum(axis=1))
    normals = normals / np.where(length > 0.0, length, 1.0)[:, None]
    # One sign for the whole curve: it is tracked on one side of the surface. The sign is read
    # where the curve runs nearest to the reference direction.
    along = normals @ outward
    return normals if along[np.abs(along).argmax()] >= 0.0 else -normals
