"""Time series of one arm: readings while the tip travels, and the samples that they become."""

from dataclasses import dataclass

import numpy as np

from touchatlas.planner.tracking.friction import friction_of, normals_with_friction
from touchatlas.planner.tracking.options import Tip

# The fewest readings in a window; a parabola has three coefficients.
LEAST_READINGS = 5


@dataclass(frozen=True, eq=False)
class TimeSeries:
    """Readings of one tip while it travels along a surface.

    Parameters
    ----------
    times : (n,) float, s
        At an even period.
    positions : (n, 3) float, length, world
        Of the tip's centre if the stylus is not bent.
    forces : (n, 3) float, N, world
    travelled : (n,) float, length
        Along the surface; it does not fall.
    """

    times: np.ndarray
    positions: np.ndarray
    forces: np.ndarray
    travelled: np.ndarray


@dataclass(frozen=True, eq=False)
class CentreSamples:
    """Places of a tip in contact.

    Parameters
    ----------
    centres : (n, 3) float, length, world
        Of the tip.
    normals : (n, 3) float, unit, world
        Of the surface, outward.
    noise_std : float, length
        Of each coordinate of a centre, root mean square: it is larger where the path bends, because
        fewer readings make a sample there.
    """

    centres: np.ndarray
    normals: np.ndarray
    noise_std: float

    def contacts(self, radius: float) -> np.ndarray:
        """(n, 3) places where the tip of a radius meets the surface: c - r n."""
        return self.centres - radius * self.normals


def samples_of(
    series: TimeSeries,
    plane_normal,
    tip: Tip,
    window: float,
    least: float,
    step: float,
    step_turn: float,
) -> CentreSamples:
    """Samples a step apart along the surface, and between two where it turns; the first is that
    where the tip began.

    Each is the middle of a parabola through the readings in a window of time about it, a shorter
    one where the path bends more than a parabola. Bending is compensated, and friction taken out of
    the force.

    Parameters
    ----------
    series : TimeSeries
    plane_normal : (3,) float, unit, world
        The tip travels along this x the normal of the surface.
    tip : Tip
    window : float, s
    least : float, N
        Readings with less force are not in contact, and give no samples.
    step : float, length
    step_turn : float, rad
        Turn of the normal from one sample to the next beyond which there are others between them,
        no nearer than an eighth of the step.
    """
    count = _readings_in(series.times, window)
    # An arm that is shorter has a shorter window.
    count = min(count, len(series.times) - 1 + len(series.times) % 2)
    if count < LEAST_READINGS:
        return CentreSamples(np.zeros((0, 3)), np.zeros((0, 3)), tip.sample_std(1))
    centres = series.positions + series.forces / tip.stiffness
    centres, force, noise = _smoothed(centres, series.forces, count, tip)
    # Over twenty deviations to either side a direction is good to 3 degrees.
    half = max(0.3 * step, 20.0 * tip.sample_std(count))
    along = _directions(centres, series.travelled, half)
    touching = _all_about(np.sqrt((series.forces**2).sum(axis=1)) > least, count)
    normals = normals_with_friction(
        force, plane_normal, friction_of(force[touching], along[touching])
    )
    # A parabola is half as sure at its ends. At the contact several arms meet.
    touching[-(count // 2) :] = False
    chosen = _apart(series.travelled, normals, touching, step, step_turn)
    mean = np.sqrt(np.mean(noise[chosen] ** 2)) if len(chosen) else tip.sample_std(count)
    return CentreSamples(centres[chosen], normals[chosen], float(mean))


def _smoothed(
    centres, forces, count: int, tip: Tip, halvings: int = 2, sure: float = 3.5
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres and forces (n, 3) smoothed in the longest of some windows, of which the first has
    ``count`` readings and the others half of those before, that agrees with the next one to so many
    deviations; and the deviations (n,) of each coordinate of the centres, length.

    Lepskii, On a problem of adaptive estimation in Gaussian white noise, Theory of Probability and
    its Applications 35 (1991).
    """
    both = np.hstack([centres, forces])
    found, bends = smoothed(both, count), np.ones(len(both), bool)
    noise = np.full(len(both), tip.sample_std(count))
    for _ in range(halvings):
        count = 2 * (count // 4) + 1
        if count < LEAST_READINGS:
            break
        shorter = smoothed(both, count)
        off = found[:, :3] - shorter[:, :3]
        bends &= (off * off).sum(axis=1) > (sure * tip.sample_std(count)) ** 2
        found = np.where(bends[:, None], shorter, found)
        noise[bends] = tip.sample_std(count)
    return found[:, :3], found[:, 3:], noise


def smoothed(values: np.ndarray, count: int) -> np.ndarray:
    """(n, 3) values at the middle of parabolas through ``count`` neighbouring rows, an odd number
    of 3 or more, and at the ends of the nearest.

    A mean would cut off where the path bends: by L^2 / 24 R over a length L.

    Savitzky and Golay, Smoothing and differentiation of data by simplified least squares
    procedures, Analytical Chemistry 36 (1964).

    >>> smoothed(np.arange(5.0)[:, None] ** 2, 5).ravel().round(9)
    array([ 0.,  1.,  4.,  9., 16.])
    """
    from scipy.signal import savgol_filter

    means: np.ndarray = savgol_filter(values, count, 2, axis=0, mode="interp")
    return means


def _all_about(holds: np.ndarray, count: int) -> np.ndarray:
    """(n,) whether something holds at all of the nearest ``count`` of n readings, an odd number."""
    from scipy.ndimage import minimum_filter1d

    found: np.ndarray = minimum_filter1d(holds.astype(np.uint8), count, mode="nearest") > 0
    return found


def _readings_in(times: np.ndarray, window: float) -> int:
    """How many readings a window of time holds: an odd number, enough for a parabola."""
    if len(times) < LEAST_READINGS:
        return len(times)
    period = float(np.median(np.diff(times)))
    return max(LEAST_READINGS, 2 * round(0.5 * window / period) + 1)


def _directions(centres: np.ndarray, travelled: np.ndarray, half: float) -> np.ndarray:
    """(n, 3) unit directions of a path over a length ``half`` to either side."""
    last = len(centres) - 1
    behind = np.maximum(np.searchsorted(travelled, travelled - half, "right") - 1, 0)
    ahead = np.minimum(np.searchsorted(travelled, travelled + half), last)
    chords = centres[ahead] - centres[behind]
    length = np.sqrt((chords * chords).sum(axis=1))[:, None]
    directions: np.ndarray = chords / np.maximum(length, 1e-300)
    return directions


def _apart(travelled, normals, touching, step: float, step_turn: float) -> np.ndarray:
    """(k,) indices of samples, one a step, finer where normals (n, 3) turn."""
    chosen: list[int] = []
    place, facing = -np.inf, normals[0]
    least = np.cos(step_turn)
    # Candidates an eighth of a step apart: what lies between them is in their windows.
    eighths = np.floor(8.0 * travelled / step).astype(int)
    for at in np.flatnonzero(np.append(True, np.diff(eighths) > 0)).tolist():
        if not touching[at]:
            continue
        gone = travelled[at] - place
        if gone > 0.94 * step or (gone > 0.0 and normals[at] @ facing < least):
            chosen.append(at)
            place, facing = travelled[at], normals[at]
    return np.array(chosen, int)
