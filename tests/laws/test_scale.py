"""Scaling all input by s scales the answer of a whole exploration by s."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful_meshes import lawful_object
from tests.sharp import sharp_object
from tests.truths import scaled
from touchatlas.atlas import Atlas, Surface, Touch, extract_surface
from touchatlas.patch import SamplingPlane
from touchatlas.planner import Planner, ProbePlan, explore
from touchatlas.sim import Probe

# One law, a free-form body, planes, and planes with a cylinder; touches by which they have faces.
BODIES = {"sphere": 4, "bottle": 4, "block": 9, "cylinder": 8}
# What a power of two scales has the same digits, and all that follows from it.
POWER = 2.0**10


def scaled_plan(plan: ProbePlan, scale: float) -> ProbePlan:
    until = plan.until
    return replace(
        plan,
        reference_point=scale * plan.reference_point,
        planes=tuple(SamplingPlane(scale * p.point, p.normal) for p in plan.planes),
        reach=scale * plan.reach,
        step=scale * plan.step,
        until=None if until is None else lambda points: until(points / scale),
        approach=scale * plan.approach,
    )


@lru_cache
def exploration(name: str, scale: float) -> tuple[list[Touch], Atlas, Surface]:
    """Touches, atlas and surface of an exploration of a body that is enlarged by ``scale``."""
    obj = lawful_object(name) if name == "cylinder" else sharp_object(name)
    probe = Probe(obj, obj.noise_std, np.random.default_rng(0))
    start, outward = obj.start()
    atlas, planner = Atlas(scale * obj.tolerance), Planner(scale * start, outward)

    def enlarged(plan: ProbePlan) -> Touch:
        return scaled(probe(scaled_plan(plan, 1.0 / scale)), scale)

    touches = [step.touch for step in explore(atlas, planner, enlarged, BODIES[name])]
    atlas.finish()
    return touches, atlas, extract_surface(atlas)


NAMES = [
    pytest.param(n, marks=pytest.mark.slow if n in ("block", "cylinder") else ()) for n in BODIES
]


@pytest.mark.parametrize("name", NAMES)
def test_a_power_of_two_scales_every_digit_of_the_answer(name):
    touches, atlas, surface = exploration(name, 1.0)
    large_touches, large_atlas, large = exploration(name, POWER)
    assert len(touches) == len(large_touches) == BODIES[name]
    for one, other in zip(touches, large_touches, strict=True):
        assert (POWER * one.contact).tobytes() == other.contact.tobytes()
        assert one.approach.tobytes() == other.approach.tobytes()
        assert POWER * one.tracked_length == other.tracked_length
        assert POWER * one.travel_length == other.travel_length
        assert (POWER * one.way).tobytes() == other.way.tobytes()
    kinds, large_kinds = ([f.kind for f in a.body.faces.faces] for a in (atlas, large_atlas))
    assert kinds == large_kinds
    for column, power in (("vertices", 1), ("deviation", 1), ("normals", 0), ("faces", 0)):
        then, now = getattr(surface, column), getattr(large, column)
        assert (POWER**power * then).tobytes() == (1.0 * now).tobytes(), column
    assert len(surface.faces) > 100


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n == "sphere" else pytest.mark.slow) for n in BODIES]
)
def test_any_factor_scales_the_answer_to_rounding(name):
    """Fits and searches enlarge rounding, and each touch takes it over from those before: to a
    twentieth of the noise of one sample."""
    touches, atlas, surface = exploration(name, 1.0)
    large_touches, large_atlas, _ = exploration(name, 1000.0)
    some = 0.05 * touches[0].contours[0].noise_std
    for one, other in zip(touches, large_touches, strict=True):
        assert other.contact / 1000.0 == pytest.approx(one.contact, abs=some)
        assert other.approach == pytest.approx(one.approach, abs=1e-4)
    points = surface.vertices[:: len(surface.vertices) // 500]
    here, there = atlas.blend(points), large_atlas.blend(1000.0 * points)
    assert (here.known == there.known).mean() > 0.99
    both = here.known & there.known
    assert both.mean() > 0.9
    assert there.distance[both] / 1000.0 == pytest.approx(here.distance[both], abs=some)
