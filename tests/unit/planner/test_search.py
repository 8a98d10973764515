"""Search: rays past what is known, for parts that no contour leads to."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh

from tests.explored import learned, spread_touches
from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.places import Places, places_of
from touchatlas.planner.search import distances_from_lines, other_part
from touchatlas.planner.view import View
from touchatlas.sim import Probe, make_object
from touchatlas.sim.world.mesh_object import MeshObject


@lru_cache
def ball() -> tuple[Atlas, Places]:
    """A ball that is known all around."""
    obj = make_object("sphere")
    atlas = learned(spread_touches(obj, 12), obj.tolerance)
    return atlas, places_of(atlas)


def ray_after(rays):
    """The next ray past a ball after others."""
    atlas, places = ball()
    attempts = Attempts(np.zeros(3), np.array([0.0, 0.0, 1.0]), rays=rays)
    return other_part(View(atlas, PlannerOptions(search=1000), attempts), places)


@pytest.mark.slow
def test_rays_pass_what_is_known_and_other_rays():
    """Ten rays keep a twentieth of the extent clear of the ball, and differ from each other."""
    extent, before = ball()[0].pool.extent, []
    for _ in range(10):
        target = ray_after(before)
        assert target is not None and target.reason is Reason.SEARCH
        away = np.linalg.norm(np.cross(target.point, target.normal))
        # Samples are within a noise of 0.02 of the ball, and do not lie where it is nearest.
        assert away > 33.0 + 0.04 * extent
        # The chord of a ball of one extent.
        assert target.approach == pytest.approx(np.sqrt(extent**2 - away**2), rel=1e-2)
        before.append(np.stack([target.point, target.normal]))
    lines = np.array(before)
    again = distances_from_lines(lines[:, 0], lines[:, 0], lines[:, 1]) + np.eye(10) * extent
    assert again.min() > 0.0


def test_a_room_that_rays_have_seen_needs_no_further_one():
    """Rays a tenth of the extent apart see all there is."""
    grid = np.arange(-1.1, 1.1, 0.1) * ball()[0].pool.extent
    assert ray_after([]) is not None
    assert ray_after([np.array([[x, y, 0.0], [0.0, 0.0, 1.0]]) for x in grid for y in grid]) is None


def test_distances_from_lines_are_those_of_cross_products():
    rng = np.random.default_rng(0)
    points, through = rng.normal(size=(7, 3)), rng.normal(size=(5, 3))
    along = rng.normal(size=(5, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    expected = np.linalg.norm(np.cross(points[None] - through[:, None], along[:, None]), axis=-1)
    assert distances_from_lines(points, through, along) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("search", [0, pytest.param(20, marks=pytest.mark.slow)])
def test_a_second_ball_is_found_only_by_a_search(search):
    """Two balls of radii 20 and 12, with 10 between them."""
    first = trimesh.creation.icosphere(4, 20.0)
    second = trimesh.creation.icosphere(4, 12.0).apply_translation([41.0, 8.0, -4.0])
    both = trimesh.util.concatenate([first, second])
    obj = MeshObject("balls", both.vertices, both.faces)
    atlas, planner = Atlas(0.2), Planner(*obj.start(), PlannerOptions(search=search))
    probe = Probe(obj, 0.02, np.random.default_rng(0))
    reasons = [step.plan.reason for step in explore(atlas, planner, probe, 80)]
    assert planner.stop is not None and planner.stop.reason is StopReason.KNOWN
    assert reasons.count(Reason.SEARCH) == search
    points = atlas.pool.points
    # The plane between the balls.
    assert (points[:, 0] < 25.0).any() and (points[:, 0] > 25.0).any() == (search > 0)
