"""Baselines by name: what each touches, and that it ends."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import cdist

from touchatlas.atlas import Atlas, AtlasOptions, extract_surface
from touchatlas.patch import ContourEnd
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.planner.place.choose import View, distance_to, known_places, open_places
from touchatlas.planner.place.gpis import ImplicitSurface, gpis, thin_plate
from touchatlas.planner.place.places import Places
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


@pytest.mark.parametrize("rule", ["gpis", "raster"])
def test_a_baseline_ends_with_a_closed_surface(rule):
    """By the forecast of the atlas; a rule that does not ask for it may stagnate before."""
    atlas, planner, _ = explored_by(rule)
    assert planner.stop.reason in (StopReason.KNOWN, StopReason.STAGNATION)
    assert planner.stop.forecast.predicted_coverage > 0.95
    surface = extract_surface(atlas)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight and mesh.euler_number == 2
    # Within twice the tolerance of the true radius, of 60 standard deviations of the noise.
    away = np.abs(np.linalg.norm(surface.vertices, axis=1) - 33.0)
    assert np.quantile(away, 0.99) < 2.0 * atlas.tolerance


@pytest.mark.parametrize("rule", ["gpis", "raster"])
def test_a_baseline_makes_the_same_touches_at_any_scale(rule):
    """A power of two changes no digit of a length, so nothing but rounding of squares differs."""
    plans = [[step.plan for step in explored_by(rule, size, 4)[2]] for size in (1.0, 1 / 32)]
    for plan, small in zip(*plans, strict=True):
        assert 32.0 * small.reference_point == pytest.approx(plan.reference_point, abs=1e-6)
        assert 32.0 * small.reach == pytest.approx(plan.reach, rel=1e-9)


def test_a_raster_is_of_closed_parallel_sections_after_the_first_touch():
    """Each touch in one plane is across a side of the box. A predicted normal is at least 54.7
    degrees from the plane's, that of a diagonal of the box; most go once round the ball."""
    _, _, steps = explored_by("raster")
    sections = [s for s in steps if len(s.plan.planes) == 1]
    assert len(steps[0].plan.planes) == 3 and len(sections) >= 6
    for step in sections:
        (plane,) = step.plan.planes
        assert sorted(np.abs(plane.normal).tolist()) == [0.0, 0.0, 1.0]
        assert abs(plane.normal @ step.plan.normal) <= np.sqrt(1 / 3) + 1e-12
        assert step.plan.reason is Reason.EXPAND
    ends = [c.ends[0] for s in sections for c in s.touch.contours]
    assert np.mean([end is ContourEnd.CLOSED_LOOP for end in ends]) > 0.5
    assert np.mean([bool(s.change.refused) for s in sections]) < 0.5


def test_a_section_is_sampled_more_finely_where_it_bends():
    """A ball so coarsely sampled that a step turns by 16 degrees, more than 15: halved steps turn
    by 8, and noise of 0.02 on chords of 4.6 changes that by 0.6 (one standard deviation)."""
    obj, options = ball(), PlannerOptions(name="raster", step=0.1)
    atlas = Atlas(obj.tolerance, AtlasOptions(), scale=obj.tolerance)
    probe = Probe(obj, obj.noise_std, np.random.default_rng(1))
    steps = list(explore(atlas, Planner(*obj.start(), options), probe, 3))
    (section,) = steps[-1].touch.contours
    assert steps[-1].plan.step > options.step_turn * 33.0
    chords = np.diff(section.points, axis=0)
    chords /= np.linalg.norm(chords, axis=1)[:, None]
    turns = np.arccos(np.clip((chords[:-1] * chords[1:]).sum(axis=1), -1.0, 1.0))
    assert turns.max() < options.step_turn


def test_an_implicit_surface_of_a_plane_is_the_plane_and_less_sure_away_from_samples():
    """The mean is the distance from the plane, because a thin plate bends as little as it can; the
    variance grows with the distance from the samples and is about the noise's at them."""
    grid = np.stack(np.meshgrid(*2 * [np.linspace(0.0, 1.0, 12)]), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    surface = ImplicitSurface.of_samples(points, up, 1e-4, np.sqrt(2.0))
    places = np.array([[0.52, 0.47, 0.02], [0.31, 0.66, -0.03]])
    feet = surface.feet(places, up[:2], np.sqrt(2.0))
    assert np.abs(feet[:, 2]).max() < 1e-3
    assert feet[:, :2] == pytest.approx(places[:, :2])
    line = np.column_stack([np.linspace(1.0, 1.4, 5), np.full(5, 6 / 11), np.zeros(5)])
    variance = surface.variance(line)
    assert (np.diff(variance) > 0.0).all() and variance[0] < 4.0 * (1e-4**2 + 2e-8)


def test_the_variance_of_an_implicit_surface_is_that_of_the_whole_covariance():
    """By the inverse of the joint covariance of observations and one more point (Schur)."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(40, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    surface = ImplicitSurface.of_samples(points, points, 0.01, 3.0)
    place = np.array([[0.9, 0.3, -0.2]])
    whole = thin_plate(cdist(*2 * [np.concatenate([surface.points, place])]), surface.size)
    whole[np.diag_indices(80)] += 0.01**2 + (1e-4 * 3.0) ** 2
    assert surface.variance(place)[0] == pytest.approx(1.0 / np.linalg.inv(whole)[-1, -1], rel=1e-4)


def test_gpis_touches_far_from_all_samples():
    """The variance of a thin plate grows with the distance from the samples, so of all places the
    chosen one is about the farthest: no other is 1.5 times as far."""
    obj = ball()
    atlas = Atlas(obj.tolerance, AtlasOptions(), scale=obj.tolerance)
    probe, planner = Probe(obj, obj.noise_std, np.random.default_rng(1)), Planner(*obj.start())
    steps = list(explore(atlas, planner, probe, 2))
    places, samples = Places(), atlas.membership.pool.points
    places.update(atlas, (), 0)
    touched = np.array([step.touch.contact for step in steps])
    extent = float(np.linalg.norm(np.ptp(samples, axis=0)))
    none = np.zeros((0, 3))
    view = View(atlas, places, touched, touched, none, none, extent)
    target = gpis(view, None)
    every = np.concatenate([open_places(view)[0], known_places(view).points])
    assert (every == target.point).all(axis=1).any()
    assert distance_to(samples, every).max() < 1.5 * distance_to(samples, target.point[None])[0]
