"""Families of many patches: bodies, noise and tolerance, touches that do not fit together."""

from collections.abc import Callable

import numpy as np

from touchatlas.sim.study.stability.family import Family
from touchatlas.sim.study.stability_atlas.bodies import (
    NOISE,
    TOLERANCE,
    Placed,
    box,
    cup,
    dimpled,
    fork,
    handles,
    lumpy,
    slab,
    spike,
    two_balls,
)
from touchatlas.sim.study.stability_atlas.trial import Body, Trial, shifted

# Touches before the object moves: half of what a body that stays takes.
_BEFORE = 4


def usual(body: Body) -> Trial:
    """A body with the usual tolerance and noise."""
    return Trial(body, TOLERANCE, NOISE * TOLERANCE)


def _of(make: Callable[[float], Body], unit: float = 1.0):
    return lambda severity, rng: usual(make(severity * unit))


def atlas_noise(ratio: float, rng) -> Trial:
    """Noise over tolerance."""
    return Trial(lumpy(rng), TOLERANCE, ratio * TOLERANCE)


def tolerance(fraction: float, rng) -> Trial:
    """Tolerance over the diagonal, with the noise in proportion."""
    body = lumpy(rng)
    return Trial(body, fraction * body.diagonal, NOISE * fraction * body.diagonal)


def moved(distance: float, rng) -> Trial:
    """The object moves by so many tolerances after some touches."""
    body, shift = lumpy(rng), rng.normal(size=3)
    shift *= distance * TOLERANCE / np.linalg.norm(shift)
    return Trial(
        *(body, TOLERANCE, NOISE * TOLERANCE),
        lambda number, touch: shifted(touch, shift) if number >= _BEFORE else touch,
    )


def shuffled(times: float, rng) -> Trial:
    """The touches in another order, each so many times; less than once: some are lost."""
    body, count = lumpy(rng), max(1, round(times))

    def again(touches):
        every = [touches[i] for i in rng.permutation(count * len(touches)) % len(touches)]
        return every[: round(times * len(touches))]

    return Trial(body, TOLERANCE, NOISE * TOLERANCE, again=again)


def unit(scale: float, rng) -> Trial:
    """All lengths multiplied."""
    body = Placed(lumpy(rng), scale, np.zeros(3))
    return Trial(body, scale * TOLERANCE, scale * NOISE * TOLERANCE)


def offset(distance: float, rng) -> Trial:
    """The body so many diagonals from the origin."""
    body, direction = lumpy(rng), rng.normal(size=3)
    direction *= distance * body.diagonal / np.linalg.norm(direction)
    return Trial(Placed(body, 1.0, direction), TOLERANCE, NOISE * TOLERANCE)


ATLAS_FAMILIES = {
    "atlas_noise": Family("noise over tolerance", (0.0, 0.2, 0.5, 1.0, 3.0, 10.0), atlas_noise),
    "atlas_tolerance": Family(
        "tolerance over the diagonal", (1e-3, 3e-4, 1e-4, 3e-3, 0.01, 0.03), tolerance
    ),
    "atlas_slab": Family(
        "thickness of a plate, mm; its tolerance is 0.1",
        (20.0, 10.0, 5.0, 2.0, 1.0, 0.5),
        _of(slab),
    ),
    "atlas_gap": Family(
        "width of a slot, mm; the tolerance is 0.1", (16.0, 8.0, 4.0, 2.0, 1.0, 0.5), _of(fork)
    ),
    "atlas_edge": Family(
        "radius of a box's edges over the tolerance",
        (100.0, 30.0, 10.0, 3.0, 1.0),
        _of(box, TOLERANCE),
    ),
    "atlas_tip": Family(
        "radius of a cone's tip over the tolerance",
        (100.0, 30.0, 10.0, 3.0, 1.0),
        _of(spike, TOLERANCE),
    ),
    "atlas_dimple": Family(
        "width of a dimple, mm; the tolerance is 0.1", (12.0, 6.0, 3.0, 1.5, 0.8, 0.4), _of(dimpled)
    ),
    "atlas_handles": Family(
        "handles", (0.0, 1.0, 2.0, 3.0), lambda genus, rng: usual(handles(int(genus)))
    ),
    "atlas_two": Family("gap between two balls, mm", (20.0, 5.0, 1.0, 0.3), _of(two_balls)),
    "atlas_rim": Family("fraction of a ball that is open", (0.03, 0.1, 0.3, 0.5, 0.7), _of(cup)),
    "atlas_moved": Family(
        "move of the object between touches, in tolerances",
        (0.0, 0.3, 1.0, 3.0, 10.0, 50.0),
        moved,
    ),
    "atlas_order": Family(
        "times that each touch is given, shuffled", (1.0, 2.0, 3.0, 0.9, 0.7, 0.4), shuffled
    ),
    "atlas_scale": Family("factor on all lengths", (1.0, 1e-3, 1e3, 1e-6, 1e6), unit),
    "atlas_far": Family("distance from the origin in diagonals", (0.0, 1e2, 1e4, 1e6), offset),
}
