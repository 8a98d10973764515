"""Principal curvatures and directions from plane sections: Meusnier's and Euler's theorems."""

from dataclasses import dataclass

import numpy as np

# The limit of chi-square with two degrees of freedom that one in twenty true umbilics exceeds.
UMBILIC_LIMIT = -2.0 * np.log(0.05)
# Angle below which rounding of coordinates far from the origin decides, rad.
LEAST_ANGLE = 1e-9
# Largest condition number of sections that a fit accepts: they lie within about 2 degrees of
# fewer than three directions.
WORST_CONDITION = 1e3


@dataclass(frozen=True, eq=False)
class PrincipalCurvatures:
    """Principal curvatures and directions at a point.

    Parameters
    ----------
    k1, k2 : float, 1/length
        k1 >= k2; positive where the surface curves toward the outward normal.
    directions : (2, 3) float, unit, world
        Directions of k1 and of k2. They are chosen, not measured, when ``umbilic``.
    std : (2,) float, 1/length
        Standard deviations of k1 and k2.
    direction_std : float, rad
        Standard deviation of the directions in the tangent plane. It is infinite where k1 = k2.
    umbilic : bool
        Whether the data do not contradict k1 = k2, tested at a false-alarm rate of 5 %.
    condition : float
        Condition number of the system for k1 and k2. It is sqrt 2 for sections 60 degrees apart.
    """

    k1: float
    k2: float
    directions: np.ndarray
    std: np.ndarray
    direction_std: float
    umbilic: bool
    condition: float


def normal_from_tangents(tangents, outward) -> np.ndarray:
    """Unit normal N that minimises sum (N . T)^2 over the tangents T.

    Parameters
    ----------
    tangents : (m, 3) float, unit, world
        Two or more, not all parallel.
    outward : (3,) float, world
        Any vector on the outer side. It decides the sign.

    Returns
    -------
    (3,) float, unit, world

    Raises
    ------
    ValueError
        When all tangents are parallel.

    Notes
    -----
    The eigenvector of sum T T^t with the smallest eigenvalue: the paper, section 2.1.

    Examples
    --------
    >>> normal_from_tangents(np.eye(3)[:2], np.array([0.1, 0.0, 1.0])).round(12) + 0.0
    array([0., 0., 1.])
    """
    values, vectors = np.linalg.eigh(tangents.T @ tangents)
    if values[1] < LEAST_ANGLE * values[2]:
        raise ValueError(
            "all sections have the same tangent; track at least two more in other planes"
        )
    normal = vectors[:, 0]
    return normal if normal @ outward >= 0 else -normal


def normal_curvature(curvature_vectors, surface_normal):
    """Normal curvature of a surface from oblique plane sections (Meusnier).

    An oblique section has a larger curvature than the normal section through the same tangent.
    Only its part along the surface normal belongs to the surface.

    Parameters
    ----------
    curvature_vectors : (n, 3) float, 1/length, world
        Curvature times principal normal of each section at the reference point.
    surface_normal : (3,) float, unit, world
        Outward normal.

    Returns
    -------
    (n,) float, 1/length
        Positive where the surface curves toward the outward normal.

    Notes
    -----
    k_n = (k N) . n with the principal normal N of the section: do Carmo, section 3-2; the paper,
    section 2.1.

    Examples
    --------
    A circle of radius 1 on a ball of radius 2:

    >>> p = np.array([1.0, 0.0, np.sqrt(3.0)])
    >>> normal_curvature(1.0 * np.array([[-1.0, 0.0, 0.0]]), p / 2)
    array([-0.5])
    """
    return curvature_vectors @ surface_normal


def curvatures_from_sections(normal_curvatures, angles, stds):
    """Principal curvatures by least squares from three or more normal curvatures (Euler).

    k_n(a) = H + b cos 2a + c sin 2a is linear in H, b and c. Then k1, k2 = H +- sqrt(b^2 + c^2),
    and e1 is at the angle atan2(c, b) / 2.

    Parameters
    ----------
    normal_curvatures, stds : (m,) float, 1/length
        m >= 3 normal curvatures and their standard deviations.
    angles : (m,) float, rad
        Angles of the section tangents in the tangent plane.

    Returns
    -------
    k1, k2 : float, 1/length
    angle : float, rad
        Angle of e1. It is 0 when umbilic.
    std : (2,) float, 1/length
        Standard deviations of k1 and k2.
    umbilic : bool
        Whether the data do not contradict k1 = k2, at a false-alarm rate of 5 %.
    condition : float
        Condition number of the m x 3 system. It is large when directions nearly coincide (the
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
    if singular[2] < LEAST_ANGLE * singular[0]:
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
