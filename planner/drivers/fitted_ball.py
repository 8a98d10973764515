"""A ball by least squares, and the 25 points on it that ISO 10360-5 recommends."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import check_points, frozen_array
from touchatlas.patch.words import count_of

# A ball has four unknowns, and the stiffness is a fifth.
LEAST_POINTS = 6


@dataclass(frozen=True, eq=False)
class Ball:
    """The least-squares ball of points ("Gaussian associated sphere").

    Parameters
    ----------
    centre : (3,) float, length
    radius : float, length
    compliance : float, length/N
        Bending of the stylus over force; 0 where no forces were given.
    residuals : (n,) float, length
        Distance of each point from the centre, bending compensated, less the radius.
    covariance : (5, 5) float
        Of centre, radius and compliance for residuals of unit deviation.
    """

    centre: np.ndarray
    radius: float
    compliance: float
    residuals: np.ndarray
    covariance: np.ndarray

    @property
    def form(self) -> float:
        """Range of the residuals: the error of form."""
        return float(np.ptp(self.residuals))


def fit_ball(points, forces=None, compliance: float | None = None) -> Ball:
    """The ball that minimises the squares of the distances of points from it.

    With forces by the surface on the tip, points are where the tip would be if the stylus were not
    bent: p + c F lies on the ball, and the compliance c is fitted, too, unless it is given.

    Parameters
    ----------
    points, forces : (n, 3) float, length and N
    compliance : float, length/N, optional

    Raises
    ------
    ValueError
        Fewer than six points, points on one side or in one plane, so that centre and radius cannot
        be told, or points for which the least squares do not settle.

    Examples
    --------
    >>> u = pattern_1x25([0.0, 0.0, 1.0])
    >>> ball = fit_ball(5.0 * u + [1.0, 2.0, 3.0])
    >>> ball.centre.round(9), round(ball.radius, 9)
    (array([1., 2., 3.]), 5.0)
    """
    points = check_points(points, "points")
    if len(points) < LEAST_POINTS:
        raise ValueError(
            f"{count_of(len(points), 'point is', 'points are')} too few for a ball; give "
            f"{LEAST_POINTS} or more"
        )
    forces = np.zeros_like(points) if forces is None else frozen_array(forces, (None, 3), "forces")
    free = compliance is None and forces.any()
    bend = 0.0 if compliance is None else compliance
    middle = points.mean(axis=0)
    points, scale = points - middle, float(np.ptp(points, axis=0).max())
    unknowns = np.append(_algebraic(points), bend)
    for _ in range(50):
        offset = points + unknowns[4] * forces - unknowns[:3]
        distance = np.sqrt((offset * offset).sum(axis=1))
        outward = offset / np.maximum(distance, 1e-300)[:, None]
        columns = [-outward, -np.ones((len(points), 1)), (outward * forces).sum(axis=1)[:, None]]
        jacobian = np.hstack(columns if free else columns[:2])
        residuals = distance - unknowns[3]
        step, _, rank, _ = np.linalg.lstsq(jacobian, -residuals, rcond=1e-9)
        if rank < jacobian.shape[1]:
            raise ValueError(
                "the points do not tell a ball; touch it all around, from the pole to the equator"
            )
        unknowns[: len(step)] += step
        if np.abs(step[:4]).max() < 1e-10 * scale:
            break
    else:
        raise ValueError(
            "the points lie on no ball: the least squares do not settle in 50 steps; see that all "
            "are on one ball, and in one frame and unit"
        )
    covariance = np.zeros((5, 5))
    covariance[: len(step), : len(step)] = np.linalg.inv(jacobian.T @ jacobian)
    return Ball(
        unknowns[:3] + middle, float(unknowns[3]), float(unknowns[4]), residuals, covariance
    )


def _algebraic(points) -> np.ndarray:
    """Centre and radius (4,) by |p|^2 = 2 c p + r^2 - |c|^2, which is linear."""
    rows = np.hstack([2.0 * points, np.ones((len(points), 1))])
    solution = np.linalg.lstsq(rows, (points * points).sum(axis=1), rcond=None)[0]
    square = solution[3] + solution[:3] @ solution[:3]
    return np.append(solution[:3], np.sqrt(max(square, 0.0)))


def pattern_1x25(axis) -> np.ndarray:
    """(25, 3) directions on the half ball around an axis, as ISO 10360-5 recommends them.

    One at the pole; 4 at 22.5 degrees below it; 8 at 45; 4 at 67.5; 8 at 90, on the equator. Each
    ring is turned by 22.5 degrees against the one above.

    >>> pattern_1x25([0.0, 0.0, 1.0])[0]
    array([0., 0., 1.])
    """
    axis = frozen_array(axis, (3,), "axis") / np.linalg.norm(axis)
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    beside = np.cross(axis, across)
    found = [axis]
    for ring, count in enumerate((4, 8, 4, 8), 1):
        polar = np.radians(22.5 * ring)
        turns = np.radians(22.5 * ring) + 2.0 * np.pi * np.arange(count) / count
        found += [
            np.cos(polar) * axis + np.sin(polar) * (np.cos(t) * across + np.sin(t) * beside)
            for t in turns
        ]
    return np.array(found)


def form_1x25(points, ball: Ball, axis) -> float | None:
    """Range of the distances of the 25 points nearest to the pattern from their own ball.

    None where the points do not cover the pattern: each place needs a point of its own within 11.25
    degrees.

    Parameters
    ----------
    points : (n, 3) float, length
        Centres of the tip.
    ball : Ball
        Of all of them.
    axis : (3,) float
        From the centre of the ball to the pole of the pattern: along the stylus.
    """
    offset = np.asarray(points) - ball.centre
    u = offset / np.sqrt((offset * offset).sum(axis=1))[:, None]
    cosines = pattern_1x25(axis) @ u.T
    nearest = cosines.argmax(axis=1)
    # Half of the angle between neighbours: a point within it belongs to one place.
    near = np.cos(np.radians(11.25))
    if cosines.max(axis=1).min() < near or len(set(nearest.tolist())) < len(nearest):
        return None
    return fit_ball(np.asarray(points)[nearest]).form
