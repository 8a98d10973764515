"""What a ball of known radius tells of a probe: radius of its tip, stiffness, noise, form.

The errors are named after ISO 10360-5:2020, and differ from it in three points. The standard has
the tip qualified on one ball and tested on another; here one ball does both, so that the error of
size is a test only against a radius that was stated. It prescribes 25 points, or four scan lines;
here those points are taken that are nearest to the 25, and scan lines as they were recorded. The
error of form of the ball is in the figures.
"""

from contextlib import suppress
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from touchatlas.patch.geometry.arrays import frozen_array, real
from touchatlas.planner.drivers.fitted_ball import Ball, fit_ball, form_1x25
from touchatlas.planner.tracking.options import Tip


@dataclass(frozen=True, eq=False)
class Qualification:
    """A probe, as a ball of known radius shows it.

    Parameters
    ----------
    tip : Tip
        Radius, stiffness and noise with their deviations.
    points : int
        Points, or readings in contact.
    centre : (3,) float, length
        Of the ball.
    form_1x25 : float, length, optional
        P_Form.Sph.1x25, of single points; None where they do not cover the pattern.
    form_scan : float, length, optional
        P_Form.Sph.Scan, of scan lines; None for single points.
    size : float, length, optional
        Diameter less that of the ball, with the radius of the tip that was stated: P_Size.Sph.
    bends : bool
        Whether the stiffness was measured or stated; else that of the tip is a default.
    said : tuple of str
        What to know of these figures, in sentences.
    """

    tip: Tip
    points: int
    centre: np.ndarray
    form_1x25: float | None
    form_scan: float | None
    size: float | None
    bends: bool
    said: tuple[str, ...] = ()


def qualify(
    points,
    ball_radius: float,
    forces=None,
    ball_std: float = 0.0,
    radius: float | None = None,
    stiffness: float | None = None,
    stiffness_std: float = 0.0,
    axis=(0.0, 0.0, 1.0),
    scanned: bool = False,
) -> Qualification:
    """What points on a ball tell of a probe.

    Parameters
    ----------
    points : (n, 3) float, length
        Centres of the tip; with forces, where they would be if the stylus were not bent.
    ball_radius, ball_std : float, length
        Radius of the ball, and its standard deviation, by certificate.
    forces : (n, 3) float, N, optional
        By the surface on the tip.
    radius : float, length, optional
        Stated radius of the tip, which gives the error of size.
    stiffness, stiffness_std : float, N/length and relative, optional
        Stated ones, which are kept where the forces do not tell them.
    axis : (3,) float
        From the centre of the ball to the pole of the pattern of 25 points: along the stylus.
    scanned : bool
        Whether points are successive readings along scan lines, and no single points.

    Raises
    ------
    ValueError
        In one sentence: a radius that is none, points that do not tell a ball, a ball that is
        smaller than the one touched, forces that tell no stiffness where none is stated.
    """
    if not 0.0 < real(ball_radius) < np.inf:
        raise ValueError(f"the radius of the ball is {ball_radius!r}; it must be more than 0")
    if not 0.0 <= real(ball_std) < np.inf:
        raise ValueError(f"the deviation of the ball is {ball_std!r}; it must be 0 or more")
    if stiffness is not None and not 0.0 < real(stiffness) < np.inf:
        raise ValueError(f"the stiffness is {stiffness!r}; it must be more than 0")
    if not np.linalg.norm(frozen_array(axis, (3,), "axis")) > 0.0:
        raise ValueError(f"axis is {axis!r}; it must have a direction")
    if radius is not None and not 0.0 <= real(radius) < np.inf:
        raise ValueError(f"the stated radius is {radius!r}; it must be 0 or more")
    said: list[str] = []
    ball = fit_ball(points)
    if forces is not None:
        forces, inward = _by_surface(np.asarray(forces, float), points, ball)
        if inward:
            said.append("forces point into the ball: they were taken as those of the tip on it")
        ball, stiffness, stiffness_std = _with_stiffness(
            points, forces, stiffness, stiffness_std, said
        )
    rms, found = _rms(ball), ball.radius - ball_radius
    if found <= 0.0:
        raise ValueError(
            f"the points lie on a ball of radius {ball.radius:.6g}, and that touched has "
            f"{ball_radius:.6g}, so no tip is left; see radius, diameter, unit, and that the "
            "points are centres of the tip"
        )
    white, common, several = _noise(ball.residuals, rms, scanned)
    spread = rms * np.sqrt(ball.covariance[3, 3] * several)
    said += [] if scanned else _missed_alike(ball, rms)
    centres = np.asarray(points) + ball.compliance * (0.0 if forces is None else forces)
    form = None if scanned else form_1x25(centres, ball, axis)
    if form is None and not scanned:
        said.append(
            "P_Form.Sph.1x25 is missing: the points do not cover its 25 places on the half ball"
        )
    tip = Tip(
        radius=found,
        radius_std=float(np.hypot(spread, ball_std)),
        stiffness=Tip().stiffness if stiffness is None else stiffness,
        stiffness_std=stiffness_std,
        noise_std=white,
        force_std=0.0 if forces is None or not scanned else white_std([forces]),
        error_std=common,
    )
    size = None if radius is None else 2.0 * (found - radius)
    scan = ball.form if scanned else None
    bends = stiffness is not None
    return Qualification(tip, len(centres), ball.centre, form, scan, size, bends, tuple(said))


def white_std(rows: list[np.ndarray]) -> float:
    """White standard deviation of each column of successive rows (n, d) that change smoothly.

    Second differences have six times its variance; their median is that of a few jumps, too.

    >>> rng = np.random.default_rng(0)
    >>> round(white_std([np.linspace(0.0, 9.0, 9999)[:, None] + rng.normal(size=(9999, 1))]), 1)
    1.0
    """
    second = np.concatenate([np.diff(part, 2, axis=0).ravel() for part in rows])
    return float(np.median(np.abs(second)) / (NormalDist().inv_cdf(0.75) * np.sqrt(6.0)))


def _rms(ball: Ball) -> float:
    """Standard deviation of the residuals, by their degrees of freedom."""
    unknowns = int((ball.covariance.diagonal() > 0.0).sum())
    free = max(len(ball.residuals) - unknowns, 1)
    return float(np.sqrt((ball.residuals**2).sum() / free))


def _by_surface(forces, points, ball: Ball) -> tuple[np.ndarray, bool]:
    """Forces (n, 3) that point out of the ball, and whether they were turned round."""
    outward = np.asarray(points) - ball.centre
    inward = float((forces * outward).sum()) < 0.0
    return (-forces if inward else forces), inward


def _with_stiffness(points, forces, stiffness, stiffness_std: float, said: list[str]):
    """The ball, stiffness and its relative deviation, from forces that vary, or as stated."""
    with suppress(ValueError):
        ball = fit_ball(points, forces)
        _, _, several = _noise(ball.residuals, _rms(ball), True)
        std = _rms(ball) * float(np.sqrt(ball.covariance[4, 4] * several))
        # Three deviations from 0: chance makes no such compliance.
        if ball.compliance > 3.0 * std:
            return ball, 1.0 / ball.compliance, std / ball.compliance
    size = np.sqrt((forces * forces).sum(axis=1))
    words = f"forces from {size.min():.3g} to {size.max():.3g} N do not tell the stiffness"
    if stiffness is None:
        raise ValueError(
            f"{words} from the radius; record with two or more forces, or state the stiffness"
        )
    said.append(f"{words}: the stated one is kept")
    return fit_ball(points, forces, 1.0 / stiffness), stiffness, stiffness_std


def _missed_alike(ball: Ball, rms: float) -> list[str]:
    """That successive points miss their ball together, in a sentence; none where chance or rounding
    explains it. The ratio of von Neumann (1941) of n white residuals is 2, give or take two over
    the root of n."""
    if rms <= np.sqrt(np.finfo(float).eps) * ball.radius:
        return []
    white, _, _ = _noise(ball.residuals, rms, True)
    if (1.0 - (white / rms) ** 2) * np.sqrt(len(ball.residuals)) <= 3.0:
        return []
    return [
        f"points one after the other miss their ball alike, by {rms:.3g} where their own noise is "
        f"{white:.3g}: see that all are on one ball, and that it held still"
    ]


def _noise(residuals, rms: float, scanned: bool) -> tuple[float, float, float]:
    """White and common standard deviation of residuals, and how many of them count as one.

    Of successive readings, differences tell the white part (von Neumann 1941), and the integrated
    autocorrelation how many make one independent reading.
    """
    if not scanned or rms == 0.0:
        return rms, 0.0, 1.0
    white = min(rms, float(np.sqrt((np.diff(residuals) ** 2).mean() / 2.0)))
    common = float(np.sqrt(rms**2 - white**2))
    n = len(residuals)
    spectrum = np.abs(np.fft.rfft(residuals, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[:n]
    correlation = correlation / correlation[0]
    falls = np.flatnonzero(correlation <= 0.0)
    last = falls[0] if len(falls) else n
    return white, common, float(2.0 * correlation[:last].sum() - 1.0)
