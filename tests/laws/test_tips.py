"""Laws of touches by a ball tip: centres less the radius are what contacts show."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipped import TipProbe, explored
from tests.truths import scaled
from touchatlas.atlas import Atlas, doubts, extract_surface, load_atlas, save_atlas

TIP = 2.0


@pytest.fixture(scope="module")
def ball():
    """An atlas of the centres of a tip on a ball of radius 33."""
    return explored(TipProbe("ball", TIP, systematic_std=0.05), 1.0, 4)[0]


def test_centres_less_the_radius_are_the_body(ball):
    """Within four deviations of the radius that the law states."""
    assert ball.tip_radius == TIP
    [centres], [face] = ball.body.faces.faces, ball.faces().faces
    limit = 4.0 * face.law.numbers["radius_std"]
    assert limit < 0.02
    assert abs(centres.law.numbers["radius"] - 33.0 - TIP) < limit
    assert abs(face.law.numbers["radius"] - 33.0) < limit
    found = ball.blend(34.0 * _directions(ball))
    assert np.abs(found.distance - 1.0).max() < 3.0 * limit


def _directions(ball) -> np.ndarray:
    """(20, 3) directions about the first contact, where the ball is known."""
    first = ball.pool.points[0] / np.linalg.norm(ball.pool.points[0])
    near = first + 0.05 * np.random.default_rng(0).normal(size=(20, 3))
    return near / np.linalg.norm(near, axis=1)[:, None]


def test_the_error_that_all_samples_share_is_in_the_deviation(ball):
    """A thousand samples average their noise out, and never the error of the radius."""
    assert ball.blend([[0.0, 0.0, 33.0]]).deviation[0] > 0.05
    assert extract_surface(ball).deviation.min() > 0.05


@pytest.mark.parametrize("stated", [1.9, 2.1])
def test_a_wrong_radius_is_within_its_stated_deviation(stated):
    """The surface is off by 0.1: 1.7 deviations of 0.06, and many of what noise leaves open."""
    atlas, _ = explored(TipProbe("ball", TIP, stated, systematic_std=0.06), 1.0, 3)
    points = 33.0 * _directions(atlas)
    found = atlas.blend(points)
    assert np.allclose(found.distance, stated - TIP, rtol=0.0, atol=0.03)
    assert (np.abs(found.distance) < 1.96 * found.deviation).all()
    atlas.systematic_std = 0.0
    atlas.forget_law()
    assert (np.abs(found.distance) > 1.96 * atlas.blend(points).deviation).all()


def test_without_a_tip_what_is_handed_out_is_the_atlas_itself():
    atlas, _ = explored(TipProbe("ball", TIP, 0.0), 1.0, 1)
    assert atlas.without_tip is atlas


def test_an_atlas_of_centres_is_saved_and_loaded(tmp_path, ball):
    save_atlas(tmp_path / "atlas.npz", ball)
    again = load_atlas(tmp_path / "atlas.npz")
    again.validate()
    assert (again.tip_radius, again.systematic_std) == (TIP, 0.05)
    assert np.array_equal(extract_surface(again).vertices, extract_surface(ball).vertices)


def test_touches_of_another_tip_are_refused(ball):
    plan = explored(TipProbe("ball", TIP), 1.0, 1)[1]
    probe = TipProbe("ball", TIP)
    touch = probe(next(iter(plan.ask_several(Atlas(1.0), 1))))
    for radius in (0.0, 3.0):
        words = rf"has a tip radius of {radius:g}, but what was measured so far one of 2"
        with pytest.raises(ValueError, match=words):
            ball.add(replace(touch, tip_radius=radius))


def test_lengths_may_be_in_any_unit():
    """All lengths times s give all lengths times s."""
    probe, atlases = TipProbe("ball", TIP, systematic_std=0.05), []
    _, planner = explored(probe, 1.0, 1)
    plans = [planner.ask(Atlas(1.0))]
    touches = [probe(plan) for plan in plans]
    for scale in (1.0, 1e-3):
        atlas = Atlas(scale)
        for touch in touches:
            atlas.add(scaled(touch, scale))
        atlases.append(atlas)
    one, other = (
        a.blend(s * np.array([[0, 0, 34.0]])) for a, s in zip(atlases, (1.0, 1e-3), strict=True)
    )
    assert other.distance[0] == pytest.approx(1e-3 * one.distance[0], rel=1e-6)
    assert other.deviation[0] == pytest.approx(1e-3 * one.deviation[0], rel=1e-6)


def test_a_systematic_error_beyond_the_tolerance_is_doubted():
    atlas, _ = explored(TipProbe("ball", TIP, systematic_std=0.6), 1.0, 2)
    names = [doubt.name for doubt in doubts(atlas, extract_surface(atlas))]
    assert "systematic error" in names
