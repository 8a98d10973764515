"""Where a hole may be hidden between samples, and the smallest hole of a body."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.lawful import known_body
from tests.lawful_meshes import BORE
from tests.unit.planner.seen_places import DEVIATION, PLACES, closed, view
from touchatlas.atlas.body.round_holes import smallest_hole
from touchatlas.planner import Reason
from touchatlas.planner import sources as listed
from touchatlas.planner.sources import hidden_hole
from touchatlas.planner.view import Phase

# Distances of the first four places from samples.
AWAY = np.array([0.2, 0.6, 1.0, 0.4])


def verified(monkeypatch, radius: float, tried=(), is_one_face: bool = False, phase=Phase.GROW):
    """The target of ``hidden_hole`` on a body whose smallest hole has a radius."""
    monkeypatch.setattr(listed, "smallest_hole", lambda body: radius)
    seen = view([[0.0, 50.0, 0.0]], in_vain=tried, phase=phase)
    body = SimpleNamespace(is_one_face=is_one_face, away=lambda points: AWAY[: len(points)])
    atlas = SimpleNamespace(
        body=body,
        tolerance=seen.atlas.tolerance,
    )
    return hidden_hole(replace(seen, atlas=atlas), closed(DEVIATION[:4]))


def test_where_a_hole_may_be_hidden_the_place_farthest_from_samples_is_verified(monkeypatch):
    found = verified(monkeypatch, 0.5)
    assert found.reason is Reason.VERIFY and found.point.tolist() == PLACES[2].tolist()


def test_an_attempt_counts_as_a_sample_met_or_not(monkeypatch):
    """One that is 0.48 away from the farthest place leaves no room for a hole of 0.5 there."""
    found = verified(monkeypatch, 0.5, tried=[[4.0, 0.48, 0.0]])
    assert found.point.tolist() == PLACES[1].tolist()


@pytest.mark.parametrize(
    "other",
    [
        {"radius": 1.1},
        {"radius": np.inf},
        {"radius": 0.09, "phase": Phase.FINISH},
        {"radius": 0.5, "is_one_face": True},
    ],
    ids=["no room", "no hole", "within the tolerance at the end", "free-form"],
)
def test_elsewhere_nothing_is_verified(monkeypatch, other):
    assert verified(monkeypatch, **other) is None


def test_holes_within_the_tolerance_are_looked_for_until_the_surface_is_known(monkeypatch):
    """So that touches to a looser tolerance are the first of those to a tighter one."""
    assert verified(monkeypatch, 0.09).point.tolist() == PLACES[2].tolist()


def test_holes_below_a_fortieth_of_the_extent_are_looked_for_as_if_they_were_larger(monkeypatch):
    """0.25 of 10: a place 0.2 away from samples is not verified, one 0.4 away is."""
    assert verified(monkeypatch, 0.1, PLACES[1:]) is None
    assert verified(monkeypatch, 0.1, PLACES[1:3]).point.tolist() == PLACES[3].tolist()


@pytest.mark.parametrize("scale", [1.0, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_the_smallest_hole_is_the_bore_of_a_tube(scale):
    """Its outer side is no hole."""
    assert smallest_hole(known_body("tube", 24, scale)) == pytest.approx(scale * BORE, rel=0.02)


@pytest.mark.parametrize(
    ("name", "count"), [("box", 40), ("cylinder", 30), ("widely filleted", 24)]
)
def test_a_body_without_a_bore_has_no_hole(name, count):
    """The outer side of a cylinder is none, and a fillet is a rounded edge."""
    assert smallest_hole(known_body(name, count)) == np.inf


def test_half_of_a_bore_is_no_hole():
    body = known_body("tube", 24)
    faces = body.faces
    bore = next(f for f in faces.faces if f.law and f.law.words.startswith("hollow"))
    half = bore.samples[faces.normals[bore.samples, 0] > 0.0]
    others = [replace(f, samples=half) if f is bore else f for f in faces.faces]
    cut = SimpleNamespace(faces=replace(faces, faces=tuple(others)))
    assert smallest_hole(cut) == np.inf
