"""The paper's appendix A: a second route to principal curvatures, beside least squares."""

import numpy as np


def curvatures_of_three_sections(normal_curvatures, angles):
    """Principal curvatures k1, k2 and the angle of e1 from three normal curvatures.

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
        Two directions are equal: the paper's situation (b).

    Notes
    -----
    The unknown is theta, the angle from e1 to the section alpha. Alpha is the section whose
    curvature differs most from the others (the general case). Three equal curvatures are the
    paper's case (a), an umbilic.
    """
    k = np.asarray(normal_curvatures, dtype=float)
    angles = np.asarray(angles, dtype=float)
    apart = np.sin(angles - np.roll(angles, 1))
    if np.abs(apart).min() < 1e-9:
        raise ValueError(
            "two sections have the same direction, so three equations are fewer than three; "
            "choose sampling planes about 60 degrees apart"
        )
    if np.ptp(k) <= np.finfo(float).eps * 8 * np.abs(k).max():
        return float(k[0]), float(k[0]), 0.0
    # Alpha must differ from beta and gamma, so the middle value is never alpha.
    order = np.argsort(k)
    first = order[2] if k[order[2]] - k[order[1]] > k[order[1]] - k[order[0]] else order[0]
    second, third = (i for i in range(3) if i != first)
    theta1, theta2 = angles[second] - angles[first], angles[third] - angles[first]
    ratio = (k[first] - k[second]) / (k[first] - k[third])
    phase = np.arctan2(
        np.sin(theta1 - theta2),
        ratio * np.sin(theta2) / np.sin(theta1) - np.cos(theta1 - theta2),
    )
    theta = 0.5 * (phase - theta2)
    # Of beta and gamma, the one that determines k1 - k2 better.
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
