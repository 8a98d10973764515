"""What is doubtful about a patch that was fitted to recorded contours."""

import numpy as np

from touchatlas.patch import Patch
from touchatlas.patch.fit.bad_contacts import OUTLIER
from touchatlas.patch.fit.diagnosis import DiagnosisLimits
from touchatlas.sim.recorded.recording import Recording

MEANING = {
    "repeated points": "Points that a curve repeats exactly were counted once.",
    "noise estimated": "Without --noise, the standard deviation of each coordinate of a point was "
    "estimated from how far points scatter about a smooth arc through their neighbours on the same "
    "curve.",
    "outward side assumed": "The outward side was not given; the one to which the surface bulges "
    "was taken.",
    "curves do not meet": "The curves miss their common point by more than noise explains: one may "
    "be displaced. The fit moved each to where it most probably belongs, and the deviations hold "
    "what is uncertain about that.",
    "curves not planar": "A curve leaves its sampling plane by more than noise explains; see to "
    "nx, ny, nz, or track each curve in one plane.",
    "curves cut": "Curves were used only until they turn by 45 degrees from the reference point.",
    "edge crossed": "A curve runs over an edge; only its part on the reference point's side was "
    "used.",
    "one-sided curves": "A curve ends near the reference point, much nearer than others; the patch "
    "goes on without it there. It is better to track as far to both sides.",
    "umbilic": "k1 and k2 differ by no more than noise explains, so e1 and e2 were chosen, not "
    "measured.",
    "poorly conditioned sections": "The curves run in similar directions, so k1, k2 and their "
    "directions are ill determined; planes 60 degrees apart are best.",
    "residuals exceed noise": "The patch misses its points by more than noise explains; leave "
    "--noise out if it was given, or track shorter curves.",
    "noise exceeds residuals": "The points lie much closer to the patch than --noise says; give it "
    "in the file's unit, or leave it out.",
    "outliers": "Some points were left out as bad contacts.",
}


def residual_rms(patch: Patch, recording: Recording) -> float:
    """Root mean square distance of points from a patch, length: of those within its radius, bad
    contacts left out."""
    points = recording.all_points
    away = ((points - patch.frame.origin) ** 2).sum(axis=1)
    distance = np.abs(patch.signed_distance(points[away <= patch.radius**2]))
    typical = max(1.4826 * float(np.median(distance)), patch.noise_std)
    return float(np.sqrt(np.mean(distance[distance <= OUTLIER * typical] ** 2)))


def fit_flags(
    patch: Patch, outliers: int, residual: float, recording: Recording, estimated: bool
) -> list[str]:
    """What is doubtful about a patch fitted to a recording, as keys of ``MEANING``."""
    size = sum(len(contour.points) for contour in recording.contours)
    # Relative variances: of the residual, and of the estimated noise.
    variance = 0.5 / patch.count + (1.1 / size if estimated else 0.0)
    expected = patch.noise_std * np.exp(3.0 * np.sqrt(variance))
    expected = float(np.hypot(expected, recording.displacement_std))
    least = DiagnosisLimits().residual_ratio * recording.noise_std
    # Rounding leaves residuals of this size where there is no noise.
    rounding = 1e-6 * patch.radius
    found = {
        "umbilic": patch.curvatures.umbilic,
        # 60 degrees apart the condition is 1.4, within about 20 degrees of each other 10.
        "poorly conditioned sections": patch.condition > 10.0,
        "residuals exceed noise": residual > max(expected, rounding),
        "noise exceeds residuals": not estimated and residual < least,
        "outliers": outliers > 0,
    }
    return [flag for flag, holds in found.items() if holds]
