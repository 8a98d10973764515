"""Families of curves: their planes, lengths, samples and number."""

import numpy as np

from touchatlas.sim.study.cases import Case, Plan, touch_graph
from touchatlas.sim.study.family import Family, anywhere, entering, random_turn, smooth
from touchatlas.sim.study.heights import quadric, wavy

CURVES: dict[str, Family[Case]] = {}
family = entering(CURVES)


@family("angle between planes, degrees", 60.0, 30.0, 10.0, 5.0, 2.0, 1.0, 0.3, 0.1)
def parallel_planes(angle: float, rng) -> Case:
    """Three planes this far apart; 60 is even."""
    start, turn = random_turn(rng), np.deg2rad(angle)
    return smooth(rng, angles=(start, start + turn, start - turn))


@family(
    "angle of the third curve from the second, degrees",
    *(40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.1, 0.0),
)
def situation_b(angle: float, rng) -> Case:
    """Two curves at plus and minus 50 degrees from e1 and a third this far (degrees) from one of
    them: the paper's situation (b), where all three normal curvatures agree."""
    turn, c = random_turn(rng), np.deg2rad(50.0)
    angles = (turn + c, turn - c, turn - c + np.deg2rad(angle))
    return anywhere(quadric(0.1, -0.4, turn), rng, angles=angles)


@family(
    "lean of the planes from the normal, degrees", 0.0, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0, 89.0
)
def grazing(tilt: float, rng) -> Case:
    """All planes lean this far from the normal, to either side."""
    return smooth(rng, tilts=tuple(np.deg2rad(tilt) * rng.choice([-1.0, 1.0], 3)))


@family("samples of each contour", 61.0, 31.0, 19.0, 13.0, 9.0, 7.0, 5.0, 4.0)
def few_points(count: float, rng) -> Case:
    """Few samples of each contour."""
    return smooth(rng, counts=(int(count),) * 3)


@family("curves", 9.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0)
def few_curves(count: float, rng) -> Case:
    """Curves, evenly spread, upright."""
    n = int(count)
    angles = tuple(random_turn(rng) + np.pi / n * np.arange(n))
    plan = Plan(angles, (0.0,) * n, ((1.0, 1.0),) * n, (Plan.counts[0],) * n, (0.0,) * n)
    return touch_graph(wavy(rng), plan, rng).moved(np.eye(3), 20.0, np.zeros(3))


@family("length of one curve over the others'", 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.02)
def short_curve(length: float, rng) -> Case:
    """One curve of this length over that of the others, its samples as close."""
    counts = (Plan.counts[0], Plan.counts[0], max(3, round(Plan.counts[0] * length)))
    return smooth(rng, arms=((1.0, 1.0), (1.0, 1.0), (length, length)), counts=counts)


@family("length of one arm over R", 1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0)
def one_sided(arm: float, rng) -> Case:
    """One arm of one curve is this long; its other arm and all others are one reach."""
    return smooth(rng, arms=((1.0, 1.0), (1.0, 1.0), (arm, 1.0)))


@family("length of one arm of each curve over R", 1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0)
def all_one_sided(arm: float, rng) -> Case:
    """Every curve has one arm of this length: the point lies at the rim of what was touched."""
    return smooth(rng, arms=((arm, 1.0),) * 3)


@family("distance of the planes from the point over R", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4)
def missing_point(miss: float, rng) -> Case:
    """Planes that pass the reference point at this distance."""
    return smooth(rng, misses=tuple(miss * rng.choice([-1.0, 1.0], 3)))
