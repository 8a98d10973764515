"""Bridging: patches where samples lie between the places that were touched."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.real import real_mesh
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.sim.study.surface_peers import spread_plans
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe


def sparse(obj, count: int):
    """An object, or a built-in one's name, and an atlas of a few touches spread over it, whose arms
    reach beyond their patches."""
    obj = make_object(obj) if isinstance(obj, str) else obj
    atlas = Atlas(obj.tolerance)
    for touch in touches_of(obj, count):
        atlas.add(touch)
    return obj, atlas


def touches_of(obj, count: int) -> list[Touch]:
    rng = np.random.default_rng(3)
    probe = Probe(obj, obj.noise_std, rng)
    return [probe(plan) for plan in spread_plans(*obj.sample(4000, rng), count)]


def turned(touch: Touch, turn) -> Touch:
    """A touch in a frame of the world that is turned by a matrix (3, 3)."""
    contours = tuple(
        replace(
            contour,
            points=contour.points @ turn.T,
            plane=SamplingPlane(turn @ contour.plane.point, turn @ contour.plane.normal),
        )
        for contour in touch.contours
    )
    contact, approach = turn @ touch.contact, turn @ touch.approach
    return replace(touch, contact=contact, approach=approach, contours=contours)


@pytest.mark.parametrize(("name", "count"), [("torus", 25), ("bottle", 18), ("mouse", 18)])
def test_bridges_cover_what_the_arms_of_touches_know(name, count):
    """The truth between is known then, and lies within the deviation that is predicted for it:
    all but one in ten within two of them, where one in twenty would be by law."""
    obj, atlas = sparse(name, count)
    truth, _ = obj.sample(3000, np.random.default_rng(4))
    before = atlas.blend(truth).known
    assert before.mean() < 0.98
    change = atlas.fill()
    atlas.validate()
    assert change.added and set(change.added) <= set(atlas.graph)
    after = atlas.blend(truth)
    assert (~after.known).mean() < 0.2 * (~before).mean()
    fresh = after.known & ~before
    assert (np.abs(after.distance) <= 2.0 * after.deviation)[fresh].mean() >= 0.9


def test_bridges_reach_no_farther_than_samples():
    """Beyond the touched half nothing is learned: a patch reaches a radius about a sample."""
    obj = make_object("sphere")
    atlas, probe = Atlas(obj.tolerance), Probe(obj, obj.noise_std, np.random.default_rng(5))
    for plan in spread_plans(*obj.sample(4000, np.random.default_rng(3)), 40):
        if plan.reference_point[2] > 0.2 * obj.diagonal:
            atlas.add(probe(plan))
    atlas.fill()
    truth, _ = obj.sample(3000, np.random.default_rng(4))
    known = truth[atlas.blend(truth).known]
    samples = atlas.membership.pool.points
    apart = np.sqrt(((known[:, None] - samples) ** 2).sum(axis=-1).min(axis=1))
    assert apart.max() <= atlas.table.radius[atlas.table.rows].max()
    atlas.validate()


def test_a_finished_atlas_needs_no_bridge():
    _, atlas = sparse("sphere", 80)
    atlas.fill()
    assert not len(atlas.frontier)
    assert atlas.fill() == AtlasChange()


def test_every_bridge_has_learned_of_the_samples_about_it():
    """Where samples of one ball face all ways a patch may be of no sheet: on this mesh one had
    learned from none of them."""
    _, atlas = sparse(real_mesh("spot"), 40)
    added = atlas.fill().added
    assert len(added) > 20
    assert all(len(atlas.membership.fitted[i]) for i in added)
    atlas.validate()


@pytest.mark.parametrize("name", ["torus", "mouse"])
def test_bridges_turn_with_their_touches(name):
    """The same touches in another frame of the world give the same bridges: to 1e-7 tolerances, of
    which most is rounding that fits pass on."""
    obj, atlas = sparse(name, 20)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    moved = Atlas(obj.tolerance)
    for touch in touches_of(obj, 20):
        moved.add(turned(touch, turn))
    for one in (atlas, moved):
        one.refit_all()
        assert one.fill().added
    truth, _ = obj.sample(2000, np.random.default_rng(4))
    first, second = atlas.blend(truth), moved.blend(truth @ turn.T)
    assert (first.known == second.known).mean() > 0.999
    both = first.known & second.known
    assert np.abs(first.distance - second.distance)[both].max() < 1e-7 * obj.tolerance
