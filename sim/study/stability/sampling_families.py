"""Families of sampling: planes, lengths, counts, units, places."""

from dataclasses import replace

import numpy as np

from touchatlas.sim.study.stability.case import Case, moved, with_points
from touchatlas.sim.study.stability.family import Family, anywhere, smooth
from touchatlas.sim.study.stability.surfaces import quadric, wavy
from touchatlas.sim.study.stability.tracking import COUNT, Plan, touch_graph


def parallel_planes(angle: float, rng) -> Case:
    """Three planes this far apart, degrees; 60 is even."""
    start, step = rng.uniform(0.0, np.pi), np.deg2rad(angle)
    return smooth(rng, angles=(start, start + step, start - step))


def situation_b(angle: float, rng) -> Case:
    """Two curves at plus and minus 50 degrees from e1 and a third this far (degrees) from one of
    them: the paper's situation (b), where all three normal curvatures agree."""
    turn, c = rng.uniform(0.0, np.pi), np.deg2rad(50.0)
    angles = (turn + c, turn - c, turn - c + np.deg2rad(angle))
    return anywhere(quadric(0.1, -0.4, turn), rng, angles=angles)


def grazing(tilt: float, rng) -> Case:
    """All planes lean this far from the normal, degrees, to either side."""
    signs = rng.choice([-1.0, 1.0], 3)
    return smooth(rng, tilts=tuple(np.deg2rad(tilt) * signs))


def few_points(count: float, rng) -> Case:
    """Samples of each contour."""
    return smooth(rng, counts=(int(count),) * 3)


def few_curves(count: float, rng) -> Case:
    """Curves, evenly spread."""
    number = int(count)
    angles = tuple(rng.uniform(0.0, np.pi) + np.pi / number * np.arange(number))
    plan = Plan(angles, (0.0,) * number, ((1.0, 1.0),) * number, (COUNT,) * number, (0.0,) * number)
    return moved(touch_graph(wavy(rng), plan, rng), np.eye(3), 20.0, np.zeros(3))


def short_curve(length: float, rng) -> Case:
    """One curve of this length over that of the others, its samples as close."""
    count = max(3, round(COUNT * length))
    arms = ((1.0, 1.0), (1.0, 1.0), (length, length))
    return smooth(rng, arms=arms, counts=(COUNT, COUNT, count))


def one_sided(arm: float, rng) -> Case:
    """One arm of one curve is this long; its other arm and all others are one reach."""
    return smooth(rng, arms=((1.0, 1.0), (1.0, 1.0), (arm, 1.0)))


def all_one_sided(arm: float, rng) -> Case:
    """Every curve has one arm of this length: the point lies at the rim of what was touched."""
    return smooth(rng, arms=((arm, 1.0),) * 3)


def missing_point(miss: float, rng) -> Case:
    """Planes that pass the reference point at this distance over R."""
    return smooth(rng, misses=tuple(miss * rng.choice([-1.0, 1.0], 3)))


def scale(factor: float, rng) -> Case:
    """All lengths times this factor."""
    return moved(smooth(rng), np.eye(3), factor, np.zeros(3))


def far_away(sizes: float, rng) -> Case:
    """The touch lies this many reaches from the origin of the coordinates."""
    case = smooth(rng)
    away = rng.normal(size=3)
    return moved(case, np.eye(3), 1.0, sizes * case.reach * away / np.linalg.norm(away))


def repeated_points(fraction: float, rng) -> Case:
    """This fraction of the samples repeats the one before."""
    case = smooth(rng)

    def repeat(_, points):
        source = np.arange(len(points))
        again = np.flatnonzero(rng.uniform(size=len(points)) < fraction)
        for i in again[again > 0]:
            source[i] = source[i - 1]
        return points[source]

    return with_points(case, repeat)


def still_curve(count: float, rng) -> Case:
    """So many of the three curves have no length: the probe did not move, but for noise."""
    arms = [(1e-9, 1e-9) if i < count else (1.0, 1.0) for i in range(3)]
    return smooth(rng, arms=tuple(arms))


def other_unit(factor: float, rng) -> Case:
    """One curve of another unit: its coordinates about the point are this much larger."""
    case = smooth(rng)
    centre = case.point

    def stretched(points):
        return centre + factor * (points - centre)

    tracks = list(case.tracks)
    tracks[0] = replace(
        tracks[0], points=stretched(tracks[0].points), through=stretched(tracks[0].through)
    )
    return replace(case, tracks=tuple(tracks))


def other_frame(angle: float, rng) -> Case:
    """One curve rotated about the reference point by this angle, degrees, with its plane."""
    case = smooth(rng)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    track, turn = case.tracks[0], np.deg2rad(angle)

    def turned(v):
        along = (v @ axis)[..., None] * axis
        return along + np.cos(turn) * (v - along) + np.sin(turn) * np.cross(axis, v)

    points = case.point + turned(track.points - case.point)
    through = case.point + turned(track.through - case.point)
    moved_track = replace(track, points=points, through=through, normal=turned(track.normal))
    return replace(case, tracks=(moved_track, *case.tracks[1:]))


def wrong_plane(angle: float, rng) -> Case:
    """The stated normal of one sampling plane is off by this angle, degrees."""
    case = smooth(rng)
    track, turn = case.tracks[0], np.deg2rad(angle)
    chord = track.points[-1] - track.points[0]
    chord /= np.linalg.norm(chord)
    normal = np.cos(turn) * track.normal + np.sin(turn) * np.cross(chord, track.normal)
    wrong = replace(track, normal=normal / np.linalg.norm(normal))
    return replace(case, tracks=(wrong, *case.tracks[1:]))


FAMILIES = {
    "parallel_planes": Family(
        "angle between planes, degrees",
        (60.0, 30.0, 10.0, 5.0, 2.0, 1.0, 0.3, 0.1),
        parallel_planes,
    ),
    "situation_b": Family(
        "angle of the third curve from the second, degrees",
        (40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.1, 0.0),
        situation_b,
    ),
    "grazing": Family(
        "lean of the planes from the normal, degrees",
        (0.0, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0, 89.0),
        grazing,
    ),
    "few_points": Family(
        "samples of each contour", (61.0, 31.0, 19.0, 13.0, 9.0, 7.0, 5.0, 4.0), few_points
    ),
    "few_curves": Family(
        "curves",
        (9.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0),
        few_curves,
    ),
    "short_curve": Family(
        "length of one curve over the others'",
        (1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.02),
        short_curve,
    ),
    "one_sided": Family(
        "length of one arm over R", (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0), one_sided
    ),
    "all_one_sided": Family(
        "length of one arm of each curve over R",
        (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0),
        all_one_sided,
    ),
    "missing_point": Family(
        "distance of the planes from the point over R",
        (0.0, 1e-3, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4),
        missing_point,
    ),
    "scale": Family(
        "factor on all lengths",
        (1.0, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e5, 1e6),
        scale,
    ),
    "far_away": Family(
        "distance from the origin over R", (0.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8), far_away
    ),
    "repeated_points": Family(
        "fraction of repeated samples", (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95), repeated_points
    ),
    "still_curve": Family(
        "curves without length",
        (0.0, 1.0, 2.0, 3.0),
        still_curve,
    ),
    "other_unit": Family(
        "unit of one curve over that of the others",
        (1.0, 1.001, 1.01, 1.1, 2.0, 10.0, 25.4, 1000.0),
        other_unit,
    ),
    "other_frame": Family(
        "rotation of one curve, degrees", (0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 45.0), other_frame
    ),
    "wrong_plane": Family(
        "error of one plane's normal, degrees",
        (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0),
        wrong_plane,
    ),
}
