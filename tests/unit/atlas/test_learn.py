"""Learn: which touches are entered, with what normals, and which are refused and why."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.explored import learned, spread_touches
from touchatlas.atlas import Atlas, Levels
from touchatlas.atlas.touch_side import outer_side, quadric_of_touch
from touchatlas.planner import Planner
from touchatlas.planner.options import PlannerOptions
from touchatlas.sim import Probe, make_object

TOLERANCE, BALL = 0.1, 33.0


@pytest.fixture(scope="module")
def touches():
    return spread_touches(make_object("sphere"), 8)


def with_body(body):
    """What the outer side of a touch follows from."""
    return SimpleNamespace(body=body, bias=0.02, levels=Levels(), catch_up=lambda: None)


def outward(atlas, first: int = 0) -> np.ndarray:
    """Cosines (n,) of the normals of samples, from the ``first`` on, and the true ones."""
    points, normals = atlas.pool.points[first:], atlas.pool.normals[first:]
    return (points * normals).sum(axis=1) / np.linalg.norm(points, axis=1)


def leaning(touch, degrees: float):
    """The touch as if the probe had come at an angle from the true normal."""
    normal = touch.contact / np.linalg.norm(touch.contact)
    along = np.cross(normal, [0.3, 0.5, 0.8])
    along /= np.linalg.norm(along)
    angle = np.deg2rad(degrees)
    return replace(touch, approach=np.cos(angle) * normal + np.sin(angle) * along, way=None)


@pytest.mark.parametrize("degrees", [80.0, 100.0])
def test_of_a_grazing_touch_what_is_known_tells_the_outer_side(touches, degrees):
    """Ten degrees to either side of the surface: all normals face outward. A normal from chords of
    noise 0.02 over steps of 2 errs by 2 degrees; those at the ends of arms by some more."""
    atlas = learned(touches[:-1], TOLERANCE)
    before = atlas.point_count
    # The touch is nearest to what is known there: it lies amid the others.
    change = atlas.add(leaning(touches[-1], degrees))
    assert not change.refused
    assert (outward(atlas, before) > np.cos(np.deg2rad(15.0))).all()
    atlas.validate()


class GuessedAboutTheContact:
    """The surface of the ball, as an atlas knows it that has a guess about a contact: there its
    normal is 90 degrees off, toward where the probe came from."""

    def __init__(self, touch) -> None:
        self.touch = touch

    def at(self, points):
        normals = points / np.linalg.norm(points, axis=1)[:, None]
        distance = np.linalg.norm(points, axis=1) - BALL
        guessed = np.linalg.norm(points - self.touch.contact, axis=1) < 5.0
        normals[guessed] = self.touch.approach
        deviation = np.where(guessed, 1.0, 0.01)
        found = SimpleNamespace(distance=distance, normal=normals, deviation=deviation)
        return found, np.ones(len(points), bool)


def test_a_guess_about_the_contact_does_not_tell_the_outer_side(touches):
    """Samples away from it are on surface that is known, and they do."""
    touch = leaning(touches[0], 95.0)
    body = GuessedAboutTheContact(touch)
    state = with_body(body)
    quadric = quadric_of_touch(state, touch, touch.contours)
    outward, reason = outer_side(state, touch, touch.contours, quadric)
    assert not reason
    assert outward @ touch.contact > 0.99 * BALL


@pytest.mark.parametrize(("lean", "outside"), [(80.0, True), (95.0, False)])
def test_a_guess_about_the_contact_does_not_turn_contours_without_a_normal(touches, lean, outside):
    """The guess faces the approach in both cases. Samples of a goat's head had been turned inside
    out by it, and touches no longer improved what was known."""
    touch = leaning(touches[0], lean)
    body = GuessedAboutTheContact(touch)
    state = with_body(body)
    outward, reason = outer_side(state, touch, touch.contours[:2], None)
    assert (outward is not None) is outside and bool(reason) is not outside


def test_a_contour_without_a_normal_far_from_known_surface_needs_a_steep_approach(touches):
    """Its own side is all that tells it then."""

    class Unsure(GuessedAboutTheContact):
        def at(self, points):
            found, known = super().at(points)
            return SimpleNamespace(**vars(found) | {"deviation": np.full(len(points), 9.0)}), known

    for lean, outside in ((50.0, True), (70.0, False)):
        touch = leaning(touches[0], lean)
        state = with_body(Unsure(touch))
        assert (outer_side(state, touch, touch.contours[:1], None)[0] is not None) is outside


def test_a_grazing_touch_where_nothing_is_known_is_refused(touches):
    atlas = Atlas(TOLERANCE)
    change = atlas.add(leaning(touches[0], 80.0))
    assert "come along the normal" in change.refused
    assert not len(atlas) and atlas.point_count == 0 and atlas.touches == 1


def test_a_lean_of_sixty_degrees_is_no_matter(touches):
    atlas = Atlas(TOLERANCE)
    assert not atlas.add(leaning(touches[0], 60.0)).refused
    assert (outward(atlas) > np.cos(np.deg2rad(15.0))).all()


@pytest.mark.parametrize("count", [1, 2])
def test_a_touch_of_few_contours_on_known_surface_is_entered_with_outward_normals(touches, count):
    """One contour alone shows no normal: its normals are those of the contour, on the side that the
    known surface faces."""
    atlas = learned(touches[:-1], TOLERANCE)
    before = atlas.point_count
    few = replace(touches[-1], contours=touches[-1].contours[:count])
    assert not atlas.add(few).refused
    assert atlas.point_count == before + sum(len(c.points) for c in few.contours)
    assert (outward(atlas, before) > np.cos(np.deg2rad(15.0))).all()
    assert atlas.body.samples.points[before:].tolist() == atlas.pool.points[before:].tolist()


def test_a_touch_of_one_contour_where_nothing_is_known_is_refused_with_what_to_do(touches):
    atlas = Atlas(TOLERANCE)
    change = atlas.add(replace(touches[0], contours=touches[0].contours[:1]))
    assert "track more planes" in change.refused
    assert atlas.body is None and atlas.point_count == 0


def test_a_touch_of_one_contour_from_within_the_body_is_refused(touches):
    """Its approach is opposed to the outward normal of the known surface."""
    atlas, last = learned(touches[:-1], TOLERANCE), touches[-1]
    inside = replace(last, contours=last.contours[:1], approach=-last.approach, way=None)
    assert atlas.add(inside).refused


def test_contours_too_short_to_have_a_direction_are_refused_on_known_surface_too(touches):
    atlas = learned(touches[:-1], TOLERANCE)
    last = touches[-1]
    short = tuple(replace(c, points=c.points[:2]) for c in last.contours)
    assert "contours of" in atlas.add(replace(last, contours=short)).refused


def test_samples_have_the_noise_that_their_contours_state(touches):
    """Each counts for itself, with the lack of fit that is borne; that of the surest is the
    reference."""
    atlas = Atlas(TOLERANCE, scale=0.1)
    for noise, touch in zip((0.02, 0.04), touches[:2], strict=True):
        stated = tuple(replace(c, noise_std=noise) for c in touch.contours)
        atlas.add(replace(touch, contours=stated))
    assert set(atlas.pool.noise.tolist()) == {0.02, 0.04}
    wanted = np.hypot(atlas.pool.noise, 0.2 * 0.1)
    assert atlas.sample_stds == pytest.approx(wanted, rel=1e-12)
    assert atlas.body.samples.stds == pytest.approx(wanted, rel=1e-12)
    assert atlas.sample_std == pytest.approx(np.hypot(0.02, 0.2 * 0.1), rel=1e-12)


def test_a_touch_beside_an_edge_with_coarse_steps_has_the_normal_of_its_face(tmp_path):
    """The contact is 0.2 from an edge, and the steps are 1.7: near arcs end at the edge."""
    path = tmp_path / "box.ply"
    trimesh.creation.box((50.0, 40.0, 20.0)).export(path)
    obj = make_object(str(path))
    atlas, probe = Atlas(0.2, scale=0.1), Probe(obj, 0.02, np.random.default_rng(0))
    planner = Planner((3.0, 19.8, 10.0), (0.0, 0.0, 1.0), PlannerOptions(step=0.016))
    assert not atlas.add(probe(planner.ask(atlas))).refused
    top = atlas.pool.points[:, 2] > 9.9
    assert top.sum() > 20 and (atlas.pool.normals[top, 2] > np.cos(np.deg2rad(15.0))).all()
    atlas.validate()
