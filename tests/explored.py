"""Atlases of built-in objects, explored once each to the end; every test gets its own copy."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.kept import kept_once
from touchatlas.atlas import Atlas, Touch, TouchStatus, save_atlas
from touchatlas.atlas.body.choose import look_for_body
from touchatlas.atlas.learn import learn
from touchatlas.planner import Planner, PlannerOptions, ProbePlan, Stop, explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.study.surface_peers import spread_plans

# Touches of an exploration, at most: the built-in bodies take 7 to 20.
MOST = 40


@dataclass(frozen=True, eq=False)
class Explored:
    """A finished atlas, the touches that made it, and why there are no more; no reason where their
    number was given."""

    atlas: Atlas
    touches: list[Touch]
    stop: Stop | None


@kept_once
def explored(name: str, max_touches: int = MOST) -> Explored:
    """A copy of an exploration with seed 0."""
    return explore_body(make_object(name), max_touches)


def explore_body(
    obj, max_touches: int, seed: int = 0, options: PlannerOptions | None = None
) -> Explored:
    """An exploration of a body by the planner, to the tolerance and with the noise of the body."""
    atlas, planner = Atlas(obj.tolerance), Planner(*obj.start(), options or PlannerOptions())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(seed))
    touches = [step.touch for step in explore(atlas, planner, probe, max_touches)]
    atlas.finish()
    return Explored(atlas, touches, planner.stop)


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


def missed(plan: ProbePlan) -> Touch:
    """A touch that met nothing."""
    return Touch(
        plan.number, plan.reference_point, plan.normal, (), TouchStatus.NO_CONTACT, 0.0, 0.0
    )


def saved(atlas: Atlas, path: Path) -> bytes:
    save_atlas(path, atlas)
    return path.read_bytes()


def learned(touches, tolerance: float, scale: float | None = None) -> Atlas:
    """An atlas of touches."""
    atlas = Atlas(tolerance, scale=scale)
    for touch in touches:
        atlas.add(touch)
    return atlas


def entered(touches, tolerance: float) -> Atlas:
    """An atlas that has the samples of touches, and no surface yet."""
    atlas = Atlas(tolerance)
    for touch in touches:
        learn(atlas, touch, is_late=False)
        atlas.touches += 1
    return atlas


def learned_at_once(touches, tolerance: float) -> Atlas:
    """An atlas of touches that has looked for their surface after the last of them only."""
    atlas = entered(touches, tolerance)
    atlas.know(look_for_body(atlas.pool, atlas.sample_std))
    return atlas
