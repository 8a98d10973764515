"""Atlases of built-in objects, explored once each and shared by the tests."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.touch import Touch
from touchatlas.planner.loop import explore
from touchatlas.planner.planner import Planner
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe


@dataclass(frozen=True, eq=False)
class Explored:
    """An object's atlas and the touches that made it."""

    atlas: Atlas
    touches: list[Touch]


def object_at(name: str, scale: float):
    """A built-in object; the ball also at another scale, noise and tolerance along with it."""
    if scale == 1.0:
        return make_object(name)
    assert name == "sphere"
    radius = 33.0 * scale
    field = quadric_with_bumps((radius,) * 3)
    return ImplicitObject("ball", "", field, (radius,) * 3, 0.02 * scale, 0.1 * scale)


def explored(name: str, scale: float = 1.0, max_touches: int | None = None) -> Explored:
    """Explore with seed 1; a full exploration is kept."""
    if max_touches is None:
        return _whole(name, scale)
    return _explore(name, scale, max_touches)


def touched_again(touch: Touch, rng) -> Touch:
    """The same place touched again: every point moved by its noise."""
    contours = tuple(
        replace(c, points=c.points + c.noise_std * rng.normal(size=c.points.shape))
        for c in touch.contours
    )
    return replace(touch, contours=contours)


def _explore(name, scale, max_touches):
    obj = object_at(name, scale)
    atlas = Atlas(obj.tolerance)
    start, outward = make_object(name).start()
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    planner = Planner(scale * start, outward)
    touches = [step.touch for step in explore(atlas, planner, probe, max_touches)]
    return Explored(atlas, touches)


@lru_cache
def _whole(name, scale):
    return _explore(name, scale, None)
