"""Atlases of built-in objects, explored once each until no outline is open; every test gets its own
copy."""

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from tests.kept import kept_once
from touchatlas.atlas import Atlas, AtlasOptions, Touch
from touchatlas.planner import FrontierPlanner, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.study.surface_peers import spread_plans
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# One patch a touch, and detail left to residuals.
ONE_A_TOUCH = AtlasOptions(fill=False)
BUMPY_RADIUS, BUMPY_HEIGHT, BUMPY_FREQUENCY = 33.0, 0.02, 0.45


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
    """A copy of an exploration with seed 1."""
    return _explored(name, float(scale), max_touches)


@kept_once
def _explored(name: str, scale: float, max_touches: int | None) -> Explored:
    obj = object_at(name, scale)
    atlas = Atlas(obj.tolerance, ONE_A_TOUCH)
    start, outward = make_object(name).start()
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    planner = FrontierPlanner(scale * start, outward)
    touches = [step.touch for step in explore(atlas, planner, probe, max_touches)]
    return Explored(atlas, touches)


def touched_again(touch: Touch, rng) -> Touch:
    """The same place touched again: every point moved by its noise."""
    contours = tuple(
        replace(c, points=c.points + c.noise_std * rng.normal(size=c.points.shape))
        for c in touch.contours
    )
    return replace(touch, contours=contours)


def spread_touches(obj, count: int, noise_std: float | None = None, seed: int = 3) -> list[Touch]:
    """Touches at places spread evenly over an object, with arms that reach beyond their patches."""
    rng = np.random.default_rng(seed)
    probe = Probe(obj, obj.noise_std if noise_std is None else noise_std, rng)
    return [probe(plan) for plan in spread_plans(*obj.sample(4000, rng), count)]


@dataclass(frozen=True, eq=False)
class Bumpy:
    """A ball with bumps a fifth of a patch wide, touched at 60 places spread evenly.

    Parameters
    ----------
    atlas : Atlas
        With residuals.
    touches : list of Touch
    points : (n, 3) float
        Vertices of the ball.
    before : (n,) float
        Their distances from the atlas before it had residuals.
    count : int
        How many patches have a residual.
    """

    atlas: Atlas
    touches: list[Touch]
    points: np.ndarray
    before: np.ndarray
    count: int


def bumpy() -> Bumpy:
    """A copy of the atlas of the bumpy ball."""
    return _bumpy()


@kept_once
def _bumpy() -> Bumpy:
    sphere = trimesh.creation.icosphere(5, BUMPY_RADIUS)
    waves = np.sin(BUMPY_FREQUENCY * sphere.vertices).prod(axis=1)
    sphere.vertices *= 1.0 + BUMPY_HEIGHT * waves[:, None]
    obj = MeshObject("bumpy", np.array(sphere.vertices), np.array(sphere.faces))
    atlas, touches = Atlas(0.1, ONE_A_TOUCH), spread_touches(obj, 60, 0.005)
    for touch in touches:
        atlas.add(touch)
    points = np.array(sphere.vertices[::40])
    before = np.abs(atlas.blend(points).distance)
    return Bumpy(atlas, touches, points, before, atlas.learn_residuals())
