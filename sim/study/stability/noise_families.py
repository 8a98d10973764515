"""Families of noise: its size, what is stated of it, drift, bad contacts, contradiction."""

from dataclasses import replace

import numpy as np

from touchatlas.sim.study.stability.case import Case, with_points
from touchatlas.sim.study.stability.family import Family, smooth
from touchatlas.sim.study.stability.tracking import NOISE

# Distance of bad contacts from the surface, in noise: from ten to a hundred.
_BAD = (10.0, 100.0)


def noise(size: float, rng) -> Case:
    """Noise over R, as stated."""
    return smooth(rng, noise=size)


def stated_noise(ratio: float, rng) -> Case:
    """True noise over stated noise."""
    return smooth(rng, stated=NOISE / ratio)


def bad_contacts(fraction: float, rng) -> Case:
    """Samples that are off along the normal by 10 to 100 noises, to one side."""
    case = smooth(rng)
    return with_points(case, lambda _, points: points + _bad(len(points), fraction, rng, case))


def _bad(count: int, fraction: float, rng, case: Case) -> np.ndarray:
    off = case.noise_std * rng.uniform(*_BAD, count) * (rng.uniform(size=count) < fraction)
    return off[:, None] * case.outward


def bad_both_sides(fraction: float, rng) -> Case:
    """As ``bad_contacts``, to either side."""
    case = smooth(rng)

    def change(_, points):
        side = rng.choice([-1.0, 1.0], (len(points), 1))
        return points + side * _bad(len(points), fraction, rng, case)

    return with_points(case, change)


def drift(size: float, rng) -> Case:
    """Each contour drifts along the normal, as a random walk that ends at this many noises."""
    case = smooth(rng)

    def change(_, points):
        walk = np.cumsum(rng.normal(size=len(points))) / np.sqrt(len(points))
        return points + size * case.noise_std * walk[:, None] * case.outward

    return with_points(case, change)


def contradiction(size: float, rng) -> Case:
    """One curve lies this many noises above the others: the object moved."""
    case = smooth(rng)
    off = size * case.noise_std * rng.choice([-1.0, 1.0]) * case.outward
    return with_points(case, lambda i, points: points + off if i == 0 else points)


def uneven_noise(ratio: float, rng) -> Case:
    """One curve has this many times the noise of the others, and says so."""
    case = smooth(rng)
    extra = case.noise_std * np.sqrt(ratio**2 - 1.0)

    def change(i, points):
        return points + extra * rng.normal(size=points.shape) if i == 0 else points

    noisy = with_points(case, change)
    first = replace(noisy.tracks[0], noise_std=ratio * case.noise_std)
    return replace(noisy, tracks=(first, *noisy.tracks[1:]))


FAMILIES = {
    "noise": Family(
        "noise over R",
        (1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1),
        noise,
    ),
    "stated_noise": Family(
        "true over stated noise", (0.01, 0.1, 0.3, 1.0, 2.0, 5.0, 20.0, 100.0), stated_noise
    ),
    "bad_contacts": Family(
        "fraction of bad contacts, all to one side",
        (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4),
        bad_contacts,
    ),
    "bad_both_sides": Family(
        "fraction of bad contacts, to both sides",
        (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4),
        bad_both_sides,
    ),
    "drift": Family(
        "drift at the end of a contour, in noise", (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0), drift
    ),
    "contradiction": Family(
        "offset of one curve, in noise", (0.0, 0.5, 1.0, 2.0, 4.0, 10.0, 30.0, 100.0), contradiction
    ),
    "uneven_noise": Family(
        "noise of one curve over that of the others",
        (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0),
        uneven_noise,
    ),
}
