"""Validation finds what it says it does: one number of each kind is corrupted, and is named."""

from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import learned, spread_touches
from tests.flat import flat_touch
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas
from touchatlas.patch import ContourEnd
from touchatlas.sim import make_object


@lru_cache
def sound(name: str) -> Atlas:
    """An atlas of one free-form face, one of faces with edges, or one with lost ends."""
    return _MAKERS[name]()


def lost() -> Atlas:
    """An atlas of one touch, all of whose contours lost contact."""
    atlas = Atlas(0.01)
    touch = flat_touch(np.zeros(3), *np.eye(3)[[2, 0]], 2e-3, np.random.default_rng(0))
    ends = (ContourEnd.LOST_CONTACT,) * 2
    atlas.add(replace(touch, contours=tuple(replace(c, ends=ends) for c in touch.contours)))
    return atlas


_MAKERS = {
    "smooth": lambda: learned(spread_touches(make_object("bottle"), 6), 0.1),
    "edges": lambda: explored_sharp("block").atlas,
    "lost": lost,
    "empty": lambda: Atlas(0.1),
}


def sample(name: str, change):
    """Corrupts a property of the sample in the middle."""

    def corrupt(atlas):
        column = getattr(atlas.pool, name)
        column[len(column) // 2] = change(column[len(column) // 2])

    return corrupt


def end(name: str, change):
    """Corrupts a property of lost ends."""

    def corrupt(atlas):
        ends = atlas.rims.ends
        setattr(ends, name, change(getattr(ends, name).copy()))

    return corrupt


def known(**changes):
    """Replaces parts of what is known of faces."""

    def corrupt(atlas):
        found = {name: change(atlas.known_body) for name, change in changes.items()}
        atlas.known_body = replace(atlas.known_body, **found)

    return corrupt


def label(number: int):
    """Corrupts the face of a sample."""

    def corrupt(atlas):
        atlas.known_body.faces.of[0] = number

    return corrupt


def way_lost(atlas):
    """Corrupts the first way of the probe."""
    atlas.ways[0] = np.nan


CORRUPTIONS = {
    "point": ("smooth", sample("points", lambda v: v * np.nan), "point is not finite"),
    "point, moved": ("smooth", sample("points", lambda v: v + 5.0), "not that of its samples"),
    "normal": ("smooth", sample("normals", lambda v: 1.01 * v), "normal is not of unit"),
    "normal, none": ("smooth", sample("normals", lambda v: v * np.nan), "normal is not of unit"),
    "plane": ("smooth", sample("across", lambda v: 1.01 * v), "plane is not of unit"),
    "noise": ("smooth", sample("noise", lambda v: -v), "noise of a sample"),
    "noise, none": ("smooth", sample("noise", lambda v: v * np.nan), "noise of a sample"),
    "lost end": ("lost", end("points", lambda v: np.nan * v), "not finite"),
    "lost end's tangent": ("lost", end("tangents", lambda v: 2.0 * v), "not of unit length"),
    "lost end's normal": ("lost", end("normals", lambda v: np.nan * v), "not of unit length"),
    "lost end's step": ("lost", end("steps", lambda v: -v), "no sampling step"),
    "way": ("smooth", way_lost, "way of the probe is not finite"),
    "count": ("smooth", known(count=lambda k: k.count + 1), "more samples than there are"),
    "looked": ("smooth", known(looked=lambda k: k.count + 1), "more samples than there are"),
    "body lost": ("smooth", known(body=lambda k: None), "a body without samples"),
    "body of nothing": ("empty", known(body=lambda _: sound("smooth").body), "without samples"),
    "body of other samples": (
        "smooth",
        known(body=lambda _: sound("lost").body),
        "not that of its samples",
    ),
    "face that is not there": ("edges", label(1000), "a face that is not there"),
    "face below none": ("edges", label(-2), "a face that is not there"),
    "faces of fewer samples": ("edges", known(count=lambda k: k.count - 1), "more samples than"),
    "faces' sample": ("edges", sample("points", lambda v: v + 5.0), "not those of the pool"),
}


@pytest.mark.parametrize("kind", CORRUPTIONS)
def test_a_corrupted_number_is_found_and_named(kind):
    name, corrupt, words = CORRUPTIONS[kind]
    atlas = deepcopy(sound(name))
    corrupt(atlas)
    with pytest.raises(AssertionError, match=words):
        atlas.validate()


@pytest.mark.parametrize("name", _MAKERS)
def test_atlases_to_be_corrupted_are_sound_and_have_all_that_is_corrupted(name):
    atlas = sound(name)
    atlas.validate()
    assert (atlas.body is None) == (name == "empty")
    assert (atlas.known_body.faces is not None) == (name == "edges")
    assert (len(atlas.rims.ends) > 0) == (name == "lost")
