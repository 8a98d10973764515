"""Atlases of built-in objects, explored once each and shared by the tests."""

from copy import deepcopy
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import trimesh

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.touch import Touch
from touchatlas.planner.loop import explore
from touchatlas.planner.planner import Planner
from touchatlas.sim.study.surface_peers import spread_plans
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
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
    """Explore with seed 1; explorations are kept, and handed out as copies."""
    kept = _kept(name, scale, max_touches)
    return Explored(deepcopy(kept.atlas), list(kept.touches))


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
def _kept(name, scale, max_touches):
    return _explore(name, scale, max_touches)


@lru_cache
def bumpy():
    """A ball with bumps a fifth of a patch wide, touched at 60 places spread evenly.

    Returns its atlas with residuals, points of the ball, their distances from the atlas without
    residuals, and how many patches have one.
    """
    rng = np.random.default_rng(3)
    sphere = trimesh.creation.icosphere(5, 33.0)
    sphere.vertices *= 1.0 + 0.02 * np.sin(0.45 * sphere.vertices).prod(axis=1)[:, None]
    obj = MeshObject("bumpy", np.array(sphere.vertices), np.array(sphere.faces))
    probe, atlas = Probe(obj, 0.005, rng), Atlas(0.1)
    for plan in spread_plans(*obj.sample(2000, rng), 60):
        atlas.add(probe(plan))
    points = sphere.vertices[::40]
    before = np.abs(atlas.blend(points).distance)
    return atlas, points, before, atlas.learn_residuals()
