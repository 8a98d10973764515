"""Hidden holes: where another hole like the smallest of a body may be between samples."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.explored import explored
from tests.lawful import BORE, known_body
from touchatlas.atlas import AtlasChange, Touch, TouchStatus
from touchatlas.planner import PlannerOptions, Reason
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.pending import Pending
from touchatlas.planner.place import hidden_holes
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.place.hidden_holes import hidden_hole_target
from touchatlas.planner.place.places import Places
from touchatlas.planner.plans import plan_at

NOWHERE = np.zeros((0, 3))
# Places along x; samples are 1, 3, 5 and 2 away from them.
PLACES = np.array([[0.0, 0, 0], [10.0, 0, 0], [20.0, 0, 0], [30.0, 0, 0]])
AWAY = np.array([1.0, 3.0, 5.0, 2.0])
EXTENT = 50.0


def target(monkeypatch, radius: float, done=NOWHERE, borne: float = 0.0, is_one: bool = False):
    body = SimpleNamespace(
        field=SimpleNamespace(is_one=is_one), away=lambda points: AWAY[: len(points)]
    )
    monkeypatch.setattr(hidden_holes, "smallest_hole", lambda body: radius)
    atlas = SimpleNamespace(body=body)
    view = View(atlas, 1.0, np.zeros((1, 3)), np.reshape(done, (-1, 3)), NOWHERE, NOWHERE, EXTENT)
    four = np.zeros(len(PLACES))
    up, none = np.tile([0.0, 0.0, 1.0], (4, 1)), np.zeros(0)
    places = Places(PLACES, up, four, four + 1.0, NOWHERE, NOWHERE, none, none, none)
    return hidden_hole_target(view, places, borne)


def test_the_place_farthest_from_samples_is_verified(monkeypatch):
    found = target(monkeypatch, 2.5)
    assert found.reason is Reason.VERIFY and found.point.tolist() == PLACES[2].tolist()


def test_an_attempt_counts_as_a_sample_met_or_not(monkeypatch):
    """One that is 2.4 beside the farthest place leaves no room for a hole of 2.5 there."""
    found = target(monkeypatch, 2.5, done=[[20.0, 2.4, 0.0]])
    assert found.point.tolist() == PLACES[1].tolist()


@pytest.mark.parametrize(
    "other",
    [
        {"radius": 5.5},
        {"radius": np.inf},
        {"radius": 2.5, "borne": 2.6},
        {"radius": 2.5, "is_one": True},
    ],
    ids=["no room", "no hole", "borne", "free-form"],
)
def test_elsewhere_nothing_is_verified(monkeypatch, other):
    assert target(monkeypatch, **other) is None


def test_holes_below_a_fortieth_of_the_extent_are_looked_for_as_if_they_were_larger(monkeypatch):
    """1.25 of 50: places 1 away from samples are left, others are not."""
    assert target(monkeypatch, 0.5, done=PLACES[1:]) is None
    assert target(monkeypatch, 0.5, done=PLACES[2:]).point.tolist() == PLACES[1].tolist()


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_the_smallest_hole_is_the_bore_of_a_tube(scale):
    """Its outer side is no hole."""
    assert hidden_holes.smallest_hole(known_body("tube", 40, scale)) == pytest.approx(
        scale * BORE, rel=0.02
    )


@pytest.mark.parametrize("name", ["box", "cylinder", "widely filleted"])
def test_a_body_without_a_bore_has_no_hole(name):
    """The outer side of a cylinder is none, and a fillet is a rounded edge."""
    assert hidden_holes.smallest_hole(known_body(name, 40)) == np.inf


def test_half_of_a_bore_is_no_hole():
    body = known_body("tube", 40)
    faces = body.faces
    bore = next(f for f in faces.faces if f.law and f.law.words.startswith("hollow"))
    half = bore.samples[faces.normals[bore.samples, 0] > 0.0]
    others = [replace(f, samples=half) if f is bore else f for f in faces.faces]
    cut = SimpleNamespace(faces=replace(faces, faces=tuple(others)))
    assert hidden_holes.smallest_hole(cut) == np.inf


def test_arms_that_verify_run_on_over_what_is_known():
    """A contour must cross the rim of a hole to show it."""
    atlas, top = explored("sphere").atlas, np.array([0.0, 0.0, 33.0])
    plans = [
        plan_at(atlas, Target(top, top / 33.0, reason), 66.0, PlannerOptions())
        for reason in (Reason.VERIFY, Reason.REFINE)
    ]
    assert plans[0].until is None and plans[1].until is not None


def test_a_verifying_touch_that_met_nothing_is_tried_once_from_a_known_sample():
    """It fell into a hole: the contour from beside it crosses the rim."""
    atlas, above = explored("sphere").atlas, np.array([1.0, 0.0, 40.0])
    target = Target(above, np.array([0.0, 0.0, 1.0]), Reason.VERIFY)
    attempts = Attempts(np.zeros(3))
    attempts.ask(Pending(plan_at(atlas, target, 66.0, PlannerOptions()), False), atlas, 1.0)
    touch = Touch(0, above, target.normal, (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    change = AtlasChange(refused="the probe reported: no contact", touch=0)
    attempts.try_again(attempts.answer(touch, change), touch, change, PlannerOptions())
    # It does not count where touches are asked whether they still add something.
    assert attempts.answered == attempts.verified == 1
    again = attempts.again(atlas)
    assert again.plan.reason is Reason.VERIFY and again.place.tolist() == above.tolist()
    assert np.linalg.norm(again.plan.reference_point) == pytest.approx(33.0, abs=0.1)
    assert not again.may_miss
