"""Contours as the evidence of the probe corrects them: without bad contacts, in their planes, with
their noise, and each where it meets the others of its touch."""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from touchatlas.atlas.samples.plane_test import meeting_of, plane_test
from touchatlas.patch.fit.bad_contacts import are_bad_contacts
from touchatlas.patch.fit.curve_noise import estimate_noise
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.section import LEAST_POINTS


def without_bad(contours) -> tuple[tuple[Contour, ...], np.ndarray]:
    """The contours of a touch without bad contacts, and these (k, 3), length, world."""
    noisy = [c for c in contours if c.noise_std > 0.0 and len(c.points) >= LEAST_POINTS]
    none = tuple(contours), np.zeros((0, 3))
    if not noisy:
        return none
    factor = max(1.0, noise_within(noisy))
    bad = [are_bad_contacts(c, factor * c.noise_std) for c in contours]
    if not any(one.any() for one in bad):
        return none
    pairs = zip(contours, bad, strict=True)
    kept = tuple(c.only(~one) if one.any() else c for c, one in pairs)
    return kept, np.concatenate([c.points[one] for c, one in zip(contours, bad, strict=True)])


def noise_within(contours) -> float:
    """The noise of contours by short fits, over the stated one; 0 without any that is long
    enough."""
    some = [contour for contour in contours if len(contour.points) >= LEAST_POINTS]
    if not some:
        return 0.0
    points = [contour.points / contour.noise_std for contour in some]
    return estimate_noise(points, np.array([contour.plane.normal for contour in some]))


def noisier(contours, factor: float) -> tuple[Contour, ...]:
    """Contours whose noise is a factor times the stated one."""
    if factor == 1.0:
        return tuple(contours)
    return tuple(replace(c, noise_std=factor * c.noise_std) for c in contours)


def in_best_plane(contour: Contour, chance: float) -> Contour:
    """The contour in the plane of its samples, where these leave the stated one by more than noise
    explains with a chance."""
    test = plane_test(contour)
    if test is None or test.tilt <= chdtri(test.tilt_freedom, chance):
        return contour
    plane = replace(contour.plane, point=contour.points.mean(axis=0), normal=test.normal)
    return replace(contour, plane=plane)


def in_one_place(contours, contact, spread: float, alpha: float) -> tuple[Contour, ...]:
    """Contours of displacements with a standard deviation ``spread``, length, moved to where they
    meet most probably; what is left of the displacements joins their noise.

    The displacements are best linear unbiased predictions (Henderson, Best linear unbiased
    estimation and prediction under a selection model, 1975): each miss, less by the share of it
    that noise explains. What all contours of a touch share is not seen.
    """
    meeting = meeting_of(contours, contact, alpha)
    if meeting is None:
        return tuple(replace(c, noise_std=float(np.hypot(c.noise_std, spread))) for c in contours)
    share = spread**2 / (spread**2 + meeting.variances)
    left = spread * np.sqrt(1.0 / len(contours) + 1.0 - share)
    out = []
    for contour, miss, rest in zip(contours, share * meeting.misses, left, strict=True):
        move = miss * meeting.line
        plane = replace(contour.plane, point=contour.plane.point - move)
        noise = float(np.hypot(contour.noise_std, rest))
        out.append(replace(contour, points=contour.points - move, plane=plane, noise_std=noise))
    return tuple(out)
