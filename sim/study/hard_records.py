"""Families of records: units, frames, noise and errors of what a probe reports."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from touchatlas.sim.study.cases import Case, Plan, Track
from touchatlas.sim.study.family import Family, entering, smooth

RECORDS: dict[str, Family[Case]] = {}
family = entering(RECORDS)


@family("factor on all lengths", 1.0, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e5, 1e6)
def scale(factor: float, rng) -> Case:
    """All lengths times this factor."""
    return smooth(rng).moved(np.eye(3), factor, np.zeros(3))


@family("distance from the origin over R", 0.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8)
def far_away(sizes: float, rng) -> Case:
    """The touch lies this many reaches from the origin of the coordinates."""
    case, away = smooth(rng), rng.normal(size=3)
    return case.moved(np.eye(3), 1.0, sizes * case.reach * away / np.linalg.norm(away))


@family("fraction of repeated samples", 0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95)
def repeated_points(fraction: float, rng) -> Case:
    """This fraction of the samples repeats the one before."""

    def repeat(_, points):
        source = np.arange(len(points))
        source[1:][rng.uniform(size=len(points))[1:] < fraction] = 0
        return points[np.maximum.accumulate(source)]

    return smooth(rng).with_points(repeat)


@family("curves without length", 0.0, 1.0, 2.0, 3.0)
def still_curve(count: float, rng) -> Case:
    """So many of the three curves have no length: the probe did not move, but for noise."""
    return smooth(rng, arms=tuple((1e-9, 1e-9) if i < count else (1.0, 1.0) for i in range(3)))


@family("unit of one curve over that of the others", 1.0, 1.001, 1.01, 1.1, 2.0, 10.0, 25.4, 1000.0)
def other_unit(factor: float, rng) -> Case:
    """One curve of another unit: its coordinates about the point are this much larger."""
    return _changed_about_the_point(smooth(rng), lambda v: factor * v, lambda normal: normal)


@family("rotation of one curve, degrees", 0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 45.0)
def other_frame(angle: float, rng) -> Case:
    """One curve rotated about the reference point by this angle, with its plane."""
    case, axis, turn = smooth(rng), rng.normal(size=3), np.deg2rad(angle)
    axis /= np.linalg.norm(axis)

    def turned(v):
        along = (v @ axis)[..., None] * axis
        return along + np.cos(turn) * (v - along) + np.sin(turn) * np.cross(axis, v)

    return _changed_about_the_point(case, turned, turned)


@family("error of one plane's normal, degrees", 0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0)
def wrong_plane(angle: float, rng) -> Case:
    """The stated normal of one sampling plane is off by this angle."""
    turn = np.deg2rad(angle)

    def wrong(track: Track) -> Track:
        chord = track.points[-1] - track.points[0]
        chord /= np.linalg.norm(chord)
        normal = np.cos(turn) * track.normal + np.sin(turn) * np.cross(chord, track.normal)
        return replace(track, normal=normal / np.linalg.norm(normal))

    return _first_changed(smooth(rng), wrong)


@family("noise over R", 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
def noise(size: float, rng) -> Case:
    """Noise as stated."""
    return smooth(rng, noise=size)


@family("true over stated noise", 0.01, 0.1, 0.3, 1.0, 2.0, 5.0, 20.0, 100.0)
def stated_noise(ratio: float, rng) -> Case:
    """A probe that states another noise than it has."""
    return smooth(rng, stated=Plan.noise / ratio)


@family("fraction of bad contacts, all to one side", 0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
def bad_contacts(fraction: float, rng) -> Case:
    """Samples that are off along the normal by 10 to 100 noises, to one side."""
    case = smooth(rng)
    return case.with_points(lambda _, points: points + _bad(len(points), fraction, rng, case))


@family("fraction of bad contacts, to both sides", 0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
def bad_both_sides(fraction: float, rng) -> Case:
    """As ``bad_contacts``, to either side."""
    case = smooth(rng)

    def change(_, points):
        side = rng.choice([-1.0, 1.0], (len(points), 1))
        return points + side * _bad(len(points), fraction, rng, case)

    return case.with_points(change)


def _bad(count: int, fraction: float, rng, case: Case) -> np.ndarray:
    off = case.noise_std * rng.uniform(10.0, 100.0, count) * (rng.uniform(size=count) < fraction)
    return off[:, None] * case.outward


@family("drift at the end of a contour, in noise", 0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
def drift(size: float, rng) -> Case:
    """Each contour drifts along the normal, as a random walk that ends at this many noises."""
    case = smooth(rng)

    def change(_, points):
        walk = np.cumsum(rng.normal(size=len(points))) / np.sqrt(len(points))
        return points + size * case.noise_std * walk[:, None] * case.outward

    return case.with_points(change)


@family("offset of one curve, in noise", 0.0, 0.5, 1.0, 2.0, 4.0, 10.0, 30.0, 100.0)
def contradiction(size: float, rng) -> Case:
    """One curve lies this many noises above the others: the object moved."""
    case = smooth(rng)
    off = size * case.noise_std * rng.choice([-1.0, 1.0]) * case.outward
    return case.with_points(lambda i, points: points + off if i == 0 else points)


@family("noise of one curve over that of the others", 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0)
def uneven_noise(ratio: float, rng) -> Case:
    """One curve has this many times the noise of the others, and says so."""
    case = smooth(rng)
    extra = case.noise_std * np.sqrt(ratio**2 - 1.0)

    def noisier(track: Track) -> Track:
        points = track.points + extra * rng.normal(size=track.points.shape)
        return replace(track, points=points, noise_std=ratio * case.noise_std)

    return _first_changed(case, noisier)


def _first_changed(case: Case, change: Callable[[Track], Track]) -> Case:
    return replace(case, tracks=(change(case.tracks[0]), *case.tracks[1:]))


def _changed_about_the_point(case: Case, change, of_normal) -> Case:
    """The case with the first curve and its plane changed, as functions of vectors say."""

    def changed(track: Track) -> Track:
        points, through = (
            case.point + change(x - case.point) for x in (track.points, track.through)
        )
        return replace(track, points=points, through=through, normal=of_normal(track.normal))

    return _first_changed(case, changed)
