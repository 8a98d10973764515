"""Meusnier, Euler: from curvatures of plane sections to principal curvatures and directions."""

from dataclasses import dataclass

import numpy as np

# Chance that a true umbilic is called none: the tail of a chi-square with two degrees of freedom.
UMBILIC_FALSE_ALARM = 0.05
UMBILIC_LIMIT = -2.0 * np.log(UMBILIC_FALSE_ALARM)
_ANGLE_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class PrincipalCurvatures:
    """Principal curvatures and directions at a point.

    Parameters
    ----------
    k1, k2 : float, 1/length
        k1 >= k2; positive where the surface bends toward the outward normal.
    directions : (2, 3) float, unit, world
        Of k1 and of k2; chosen, not measured, when ``umbilic``.
    std : (2,) float, 1/length
        Standard deviations of k1 and k2.
    direction_std : float, rad
        Standard deviation of the directions in the tangent plane; infinite where k1 = k2.
    umbilic : bool
        Whether k1 = k2 within what the data can tell, at a false-alarm rate of
        UMBILIC_FALSE_ALARM.
    condition : float
        Condition number of the system that was solved; sqrt 2 for sections 60 degrees apart.
    """

    k1: float
    k2: float
    directions: np.ndarray
    std: np.ndarray
    direction_std: float
    umbilic: bool
    condition: float


def normal_from_tangents(tangents, outward) -> np.ndarray:
    """Unit normal that is most nearly orthogonal to all tangents: min sum (N . T)^2.

    Parameters
    ----------
    tangents : (m, 3) float, unit, world
        Two or more, not all parallel.
    outward : (3,) float, world
        Any vector on the outer side: it fixes the sign.

    Returns
    -------
    (3,) float, unit, world

    Raises
    ------
    ValueError
        When all tangents are parallel.

    Notes
    -----
    The paper, section 2.1; the eigenvector of sum T T^t with the smallest eigenvalue.

    Examples
    --------
    >>> normal_from_tangents(np.eye(3)[:2], np.array([0.1, 0.0, 1.0])).round(12) + 0.0
    array([0., 0., 1.])
    """
    values, vectors = np.linalg.eigh(tangents.T @ tangents)
    if values[1] < _ANGLE_TOLERANCE * values[2]:
        raise ValueError(
            "all sections have the same tangent; track at least two more in other planes"
        )
    normal = vectors[:, 0]
    return normal if normal @ outward >= 0 else -normal


def normal_curvature(section_curvature, curve_normal, surface_normal):
    """Normal curvature of a surface from oblique plane sections (Meusnier).

    A slanting cut bends more than the upright cut through the same tangent; only its part
    along the surface normal belongs to the surface.

    Parameters
    ----------
    section_curvature : (n,) float, 1/length
        Curvature of each section at the reference point, >= 0.
    curve_normal : (n, 3) float, unit, world
        Principal normal of each section, toward its centre of curvature.
    surface_normal : (3,) float, unit, world
        Outward normal.

    Returns
    -------
    (n,) float, 1/length
        Positive where the surface bends toward the outward normal.

    Notes
    -----
    k_n = k (N . n): do Carmo, section 3-2; the paper, section 2.1.

    Examples
    --------
    A circle of radius 1 on a ball of radius 2:

    >>> p = np.array([1.0, 0.0, np.sqrt(3.0)])
    >>> normal_curvature(np.array([1.0]), np.array([[-1.0, 0.0, 0.0]]), p / 2)
    array([-0.5])
    """
    return section_curvature * (curve_normal @ surface_normal)


def curvatures_from_sections(normal_curvatures, angles, stds):
    """Principal curvatures by least squares from three or more normal curvatures (Euler).

    k_n(a) = H + b cos 2a + c sin 2a is linear in H, b, c; then k1, k2 = H +- sqrt(b^2 + c^2)
    and e1 lies at angle atan2(c, b) / 2.

    Parameters
    ----------
    normal_curvatures, stds : (m,) float, 1/length
        m >= 3, with their standard deviations.
    angles : (m,) float, rad
        Of the section tangents in the tangent plane.

    Returns
    -------
    k1, k2 : float, 1/length
    angle : float, rad
        Of e1; 0 when umbilic.
    std : (2,) float, 1/length
    umbilic : bool
        Tested at a false-alarm rate of UMBILIC_FALSE_ALARM.
    condition : float
        Of the m x 3 system: large when the sections cannot tell H, b and c apart (the
        paper's situation (b)).

    Raises
    ------
    ValueError
        Fewer than three sections, or fewer than three distinct directions.

    Notes
    -----
    do Carmo, section 3-2 (Euler); the paper, equations (2) and (6).

    Examples
    --------
    >>> a = np.array([0.0, np.pi / 3, -np.pi / 3])
    >>> k = 3 * np.cos(a) ** 2 + 1 * np.sin(a) ** 2
    >>> k1, k2, angle, *_ = curvatures_from_sections(k, a, np.full(3, 1e-6))
    >>> round(k1, 9), round(k2, 9), abs(round(angle, 9))
    (3.0, 1.0, 0.0)
    """
    angles = np.asarray(angles, dtype=float)
    if len(angles) < 3:
        raise ValueError(f"{len(angles)} sections were given; principal curvatures need 3 or more")
    design = np.stack([np.ones(len(angles)), np.cos(2 * angles), np.sin(2 * angles)], axis=1)
    singular = np.linalg.svd(design, compute_uv=False)
    if singular[2] < _ANGLE_TOLERANCE * singular[0]:
        raise ValueError(
            "the sections have fewer than three distinct directions, so the principal curvatures "
            "are not determined; choose sampling planes about 60 degrees apart"
        )
    inverse = np.linalg.inv(design.T @ design)
    mean, b, c = inverse @ (design.T @ np.asarray(normal_curvatures, dtype=float))
    variance = float(np.mean(np.square(stds)))
    half_difference = float(np.hypot(b, c))
    umbilic = half_difference**2 <= UMBILIC_LIMIT * variance * 0.5 * (inverse[1, 1] + inverse[2, 2])
    angle = 0.0 if umbilic else 0.5 * float(np.arctan2(c, b))
    gradient = np.array([1.0, np.cos(2 * angle), np.sin(2 * angle)])
    std = [
        float(np.sqrt(variance * (g @ inverse @ g)))
        for g in (gradient, gradient * np.array([1.0, -1.0, -1.0]))
    ]
    k1, k2 = float(mean) + half_difference, float(mean) - half_difference
    return k1, k2, angle, np.array(std), bool(umbilic), float(singular[0] / singular[2])


def curvatures_of_three_sections(normal_curvatures, angles):
    """Principal curvatures k1, k2 and angle of e1 from three sections: the paper's appendix A.

    Parameters
    ----------
    normal_curvatures : (3,) float, 1/length
    angles : (3,) float, rad
        Of the section tangents in the tangent plane, distinct modulo pi.

    Returns
    -------
    k1, k2 : float, 1/length
    angle : float, rad, in [-pi/2, pi/2)

    Raises
    ------
    ValueError
        In the paper's situation (b): the three equations are essentially one.

    Notes
    -----
    Appendix A in the unknown theta, the angle from e1 to the first section that is taken as
    alpha, the one whose curvature differs most from the others (general case); three equal
    curvatures are case (a), an umbilic.

    Examples
    --------
    >>> a = np.array([0.2, 1.2, 2.5])
    >>> k = 3 * np.cos(a - 0.1) ** 2 - 1 * np.sin(a - 0.1) ** 2
    >>> [round(value, 9) for value in curvatures_of_three_sections(k, a)]
    [3.0, -1.0, 0.1]
    """
    k = np.asarray(normal_curvatures, dtype=float)
    angles = np.asarray(angles, dtype=float)
    apart = np.sin(angles - np.roll(angles, 1))
    if np.abs(apart).min() < _ANGLE_TOLERANCE:
        raise ValueError(
            "two sections have the same direction, so three equations are fewer than three; "
            "choose sampling planes about 60 degrees apart"
        )
    if np.ptp(k) <= np.finfo(float).eps * 8 * np.abs(k).max():
        return float(k[0]), float(k[0]), 0.0
    # Alpha must differ from beta and gamma: the middle value is never alpha.
    order = np.argsort(k)
    first = order[2] if k[order[2]] - k[order[1]] > k[order[1]] - k[order[0]] else order[0]
    second, third = (i for i in range(3) if i != first)
    theta1, theta2 = angles[second] - angles[first], angles[third] - angles[first]
    ratio = (k[first] - k[second]) / (k[first] - k[third])
    turn = np.arctan2(
        np.sin(theta1 - theta2),
        ratio * np.sin(theta2) / np.sin(theta1) - np.cos(theta1 - theta2),
    )
    theta = 0.5 * (turn - theta2)
    # Of beta and gamma, the one that tells more about k1 - k2.
    a, b, c = np.cos(2 * (theta + np.array([0.0, theta1, theta2])))
    if abs(a - b) >= abs(a - c):
        half_difference = (k[first] - k[second]) / (a - b)
    else:
        half_difference = (k[first] - k[third]) / (a - c)
    mean = k[first] - a * half_difference
    if half_difference < 0:
        half_difference, theta = -half_difference, theta + np.pi / 2
    angle = (angles[first] - theta + np.pi / 2) % np.pi - np.pi / 2
    return float(mean + half_difference), float(mean - half_difference), float(angle)


def principal_directions(shape: np.ndarray) -> tuple[float, float, float]:
    """k1, k2 and the angle of e1 from a symmetric 2 x 2 shape operator.

    >>> principal_directions(np.array([[1.0, 0.0], [0.0, 2.0]]))
    (2.0, 1.0, 1.5707963267948966)
    """
    mean = 0.5 * float(shape[0, 0] + shape[1, 1])
    b = 0.5 * float(shape[0, 0] - shape[1, 1])
    c = 0.5 * float(shape[0, 1] + shape[1, 0])
    half_difference = float(np.hypot(b, c))
    return mean + half_difference, mean - half_difference, 0.5 * float(np.arctan2(c, b))
