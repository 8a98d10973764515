"""Baselines by name: what each touches, and that it ends."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh

from touchatlas.atlas import Atlas, AtlasOptions, extract_surface
from touchatlas.patch import ContourEnd
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.sim import Probe
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject


def ball(size: float = 1.0) -> ImplicitObject:
    """A ball, with noise and tolerance in proportion."""
    radius = 33.0 * size
    field = quadric_with_bumps((radius,) * 3)
    return ImplicitObject("ball", "", field, (radius,) * 3, 0.02 * size, 0.1 * size)


@lru_cache
def explored_by(rule: str, size: float = 1.0, most: int = 60):
    """Atlas, planner and steps of a ball."""
    obj = ball(size)
    atlas = Atlas(obj.tolerance, AtlasOptions(), scale=obj.tolerance)
    planner = Planner(*obj.start(), PlannerOptions(name=rule))
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    return atlas, planner, list(explore(atlas, planner, probe, most))


@pytest.mark.parametrize("rule", ["raster"])
def test_a_baseline_ends_with_a_known_and_closed_surface(rule):
    atlas, planner, _ = explored_by(rule)
    assert planner.stop.reason is StopReason.KNOWN
    surface = extract_surface(atlas)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight and mesh.euler_number == 2
    # Within twice the tolerance of the true radius, of 60 standard deviations of the noise.
    away = np.abs(np.linalg.norm(surface.vertices, axis=1) - 33.0)
    assert np.quantile(away, 0.99) < 2.0 * atlas.tolerance


@pytest.mark.parametrize("rule", ["raster"])
def test_a_baseline_makes_the_same_touches_at_any_scale(rule):
    """A power of two changes no digit of a length, so nothing but rounding of squares differs."""
    plans = [[step.plan for step in explored_by(rule, size, 4)[2]] for size in (1.0, 1 / 32)]
    for plan, small in zip(*plans, strict=True):
        assert 32.0 * small.reference_point == pytest.approx(plan.reference_point, abs=1e-6)
        assert 32.0 * small.reach == pytest.approx(plan.reach, rel=1e-9)


def test_a_raster_is_of_closed_parallel_sections_after_the_first_touch():
    """Each touch in one plane is across a side of the box, and the predicted normal is 45 degrees
    or more from the plane's; most go once round the ball."""
    _, _, steps = explored_by("raster")
    sections = [s for s in steps if len(s.plan.planes) == 1]
    assert len(steps[0].plan.planes) == 3 and len(sections) >= 6
    for step in sections:
        (plane,) = step.plan.planes
        assert sorted(np.abs(plane.normal).tolist()) == [0.0, 0.0, 1.0]
        assert abs(plane.normal @ step.plan.normal) <= np.sqrt(0.5)
        assert step.plan.reason is Reason.EXPAND
    ends = [c.ends[0] for s in sections for c in s.touch.contours]
    assert np.mean([end is ContourEnd.CLOSED_LOOP for end in ends]) > 0.5
    assert np.mean([bool(s.change.refused) for s in sections]) < 0.5
