"""Merging and splitting keep the surface, its topology and what is covered."""

from copy import deepcopy
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas

WHOLE = {
    "sphere": lambda: explored("sphere"),
    "torus": lambda: explored("torus"),
    "bottle": lambda: explored("bottle"),
    "wall": lambda: explored_sharp("wall"),
}


@lru_cache
def _kept(name: str) -> Atlas:
    atlas = WHOLE[name]().atlas
    atlas.refit_all()
    atlas.simplify()
    return atlas


def simplified(name: str) -> Atlas:
    """A copy of an explored atlas that was refitted and simplified."""
    return deepcopy(_kept(name))


@pytest.mark.parametrize("name", ["sphere", "bottle", "torus"])
def test_merging_keeps_the_surface_and_its_topology(name):
    """One polynomial holds both patches within the noise, so the surface stays within it."""
    whole, after = WHOLE[name](), simplified(name)
    points = np.concatenate([c.points for t in whole.touches[::5] for c in t.contours])
    first, second = whole.atlas.blend(points), after.blend(points)
    assert len(after) <= len(whole.atlas)
    assert second.known.all()
    noise = np.median([whole.atlas.patch(i).noise_std for i in whole.atlas.graph])
    assert np.sqrt(np.mean((second.distance - first.distance) ** 2)) < noise
    assert after.euler_characteristic() == whole.atlas.euler_characteristic()
    after.validate()


def test_splitting_and_merging_keep_a_ball_covered():
    atlas = simplified("sphere")
    points = np.concatenate([c.points for t in explored("sphere").touches for c in t.contours])
    change = next(c for c in map(atlas.split, sorted(atlas.graph)) if not c.refused)
    atlas.validate()
    assert not set(change.removed) & set(atlas.graph)
    assert atlas.blend(points).known.all() and atlas.closed
    atlas.simplify()
    atlas.validate()
    assert atlas.blend(points).known.all() and atlas.closed


def test_a_refitted_torus_is_closed():
    """Where three radical planes meet along a line that runs beside the surface is no gap."""
    atlas = explored("torus").atlas
    atlas.refit_all()
    assert not atlas.gaps and atlas.closed and atlas.euler_characteristic() == 0


def test_patches_that_do_not_meet_are_not_merged():
    atlas = explored("torus", max_touches=25).atlas
    first = min(atlas.graph)
    second = max(
        atlas.graph,
        key=lambda i: np.linalg.norm(atlas.patch(i).frame.origin - atlas.patch(first).frame.origin),
    )
    count = len(atlas)
    assert "sheet" in atlas.merge(first, second).refused
    assert len(atlas) == count
    with pytest.raises(KeyError, match="no patch"):
        atlas.merge(first, 10**6)
    with pytest.raises(KeyError, match="no patch"):
        atlas.split(-1)
