"""A touch that comes along the surface takes its outer side from what is known there."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import spread_touches
from touchatlas.atlas import Atlas
from touchatlas.sim import make_object


@pytest.fixture(scope="module")
def touches():
    return spread_touches(make_object("sphere"), 12)


def leaning(touch, degrees: float):
    """The touch as if the probe had come at an angle from the true normal."""
    normal = touch.contact / np.linalg.norm(touch.contact)
    along = np.cross(normal, [0.3, 0.5, 0.8])
    along /= np.linalg.norm(along)
    angle = np.deg2rad(degrees)
    return replace(touch, approach=np.cos(angle) * normal + np.sin(angle) * along)


def outward(atlas) -> np.ndarray:
    """Cosine of each patch's normal and the true one."""
    rows = atlas.table.rows
    origin = atlas.table.origin[rows]
    true = origin / np.linalg.norm(origin, axis=1, keepdims=True)
    return np.einsum("ij,ij->i", true, atlas.table.axes[rows, 2])


@pytest.mark.parametrize("degrees", [80.0, 100.0])
def test_what_is_known_tells_the_side(touches, degrees):
    """Ten degrees to either side of the surface: all patches face outward, as without the lean."""
    atlas = Atlas(make_object("sphere").tolerance)
    for touch in touches[:-1]:
        atlas.add(touch)
    change = atlas.add(leaning(touches[-1], degrees))
    assert not change.refused and (outward(atlas) > 0.99).all()


def test_where_nothing_is_known_it_is_refused(touches):
    atlas = Atlas(make_object("sphere").tolerance)
    change = atlas.add(leaning(touches[0], 80.0))
    assert "come along the normal" in change.refused and not len(atlas)


def test_a_lean_of_sixty_degrees_is_no_matter(touches):
    atlas = Atlas(make_object("sphere").tolerance)
    assert not atlas.add(leaning(touches[0], 60.0)).refused
    assert (outward(atlas) > 0.99).all()
