"""Filling: patches are added where samples lie between the places that were touched."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.explored import spread_touches
from tests.real import real_mesh
from touchatlas.atlas import Atlas, AtlasChange, Touch
from touchatlas.patch import SamplingPlane
from touchatlas.sim import make_object


def atlas_of(touches: list[Touch], tolerance: float) -> Atlas:
    atlas = Atlas(tolerance)
    for touch in touches:
        atlas.add(touch)
    return atlas


def turned(touch: Touch, rotation) -> Touch:
    """A touch in a frame of the world that is turned by a matrix (3, 3)."""
    contours = tuple(
        replace(
            contour,
            points=contour.points @ rotation.T,
            plane=SamplingPlane(rotation @ contour.plane.point, rotation @ contour.plane.normal),
        )
        for contour in touch.contours
    )
    contact, approach = rotation @ touch.contact, rotation @ touch.approach
    return replace(touch, contact=contact, approach=approach, contours=contours)


@pytest.mark.parametrize(("name", "count"), [("torus", 25), ("bottle", 18), ("mouse", 18)])
def test_filling_covers_what_contours_reached(name, count):
    """The surface between the touches is known then, and lies within the predicted deviation:
    nine in ten points are within two deviations, where the law of the normal says 95 %. Where only
    a steep patch would cover a place it is left out."""
    obj = make_object(name)
    atlas = atlas_of(spread_touches(obj, count), obj.tolerance)
    surface, _ = obj.sample(3000, np.random.default_rng(4))
    atlas.validate()
    assert len(atlas) > 1.5 * count
    found = atlas.blend(surface)
    assert found.known.mean() > 0.97
    # What is farther from all contacts than the patches of these touches reach.
    contacts = np.array([touch.contact for touch in spread_touches(obj, count)])
    apart = np.sqrt(((surface[:, None] - contacts) ** 2).sum(axis=-1).min(axis=1))
    between = found.known & (apart > np.quantile(apart, 0.6))
    assert (np.abs(found.distance) <= 2.0 * found.deviation)[between].mean() >= 0.9


def test_filling_reaches_no_farther_than_samples():
    """Beyond the touched half nothing is learned: a patch reaches a radius from a sample."""
    obj = make_object("sphere")
    upper = [t for t in spread_touches(obj, 40) if t.contact[2] > 0.2 * obj.diagonal]
    atlas = atlas_of(upper, obj.tolerance)
    surface, _ = obj.sample(3000, np.random.default_rng(4))
    known = surface[atlas.blend(surface).known]
    samples = np.concatenate([c.points for touch in upper for c in touch.contours])
    apart = np.sqrt(((known[:, None] - samples) ** 2).sum(axis=-1).min(axis=1))
    assert apart.max() <= max(atlas.patch(i).radius for i in atlas.graph)
    atlas.validate()


def test_a_filled_ball_needs_no_more_patches():
    obj = make_object("sphere")
    atlas = atlas_of(spread_touches(obj, 80), obj.tolerance)
    atlas.fill()
    assert not len(atlas.frontier)
    assert atlas.fill() == AtlasChange()


def test_every_patch_that_fills_is_fitted_to_samples():
    """Samples within one ball may face all ways, and a patch may then accept none of them: on
    this mesh one was fitted to none."""
    obj = real_mesh("spot")
    atlas = atlas_of(spread_touches(obj, 40), obj.tolerance)
    assert len(atlas) > 60
    assert all(atlas.patch(i).count for i in atlas.graph)
    atlas.validate()


@pytest.mark.parametrize("name", ["torus", "mouse"])
def test_filling_does_not_depend_on_the_frame_of_the_world(name):
    """The same touches in another frame of the world give the same patches: to 1e-5 tolerances,
    most of which is rounding that the fits of few samples amplify."""
    obj = make_object(name)
    touches = spread_touches(obj, 20)
    rotation = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    atlas = atlas_of(touches, obj.tolerance)
    moved = atlas_of([turned(touch, rotation) for touch in touches], obj.tolerance)
    for one in (atlas, moved):
        one.refit_all()
        one.fill()
    surface, _ = obj.sample(2000, np.random.default_rng(4))
    first, second = atlas.blend(surface), moved.blend(surface @ rotation.T)
    assert (first.known == second.known).mean() > 0.999
    both = first.known & second.known
    assert np.abs(first.distance - second.distance)[both].max() < 1e-5 * obj.tolerance
