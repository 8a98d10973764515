"""The surface is drawn only among its samples: half-touched bodies have no flaps."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from tests.flat import plane
from tests.sharp import explored_sharp, sharp_object
from touchatlas.atlas import Atlas, extract_surface
from touchatlas.atlas.mesh.trim import rim, supported
from touchatlas.sim.world.triangles import areas_of


def half(touches, tolerance: float, side: int) -> Atlas:
    """The atlas of the touches on one side of the middle."""
    atlas = Atlas(tolerance)
    for touch in touches:
        if touch.contact[side] > 0.0:
            atlas.add(touch)
    atlas.refit_all()
    return atlas


@pytest.mark.parametrize(("name", "side"), [("block", 0), ("wall", 1)])
def test_half_touched_bodies_with_edges_have_no_flaps(name, side):
    """A face whose neighbour was not touched ends at its samples: nothing
    lies farther than three tolerances off the body, where flaps were 0.4 % of the wall's."""
    atlas, obj = half(explored_sharp(name).touches, 0.1, side), sharp_object(name)
    for change in (Atlas.refit_all, Atlas.fill):
        change(atlas)
        surface = extract_surface(atlas)
        areas = areas_of(surface.vertices, surface.faces)
        off = np.abs(obj.value(surface.vertices[surface.faces].mean(axis=1)))
        assert areas @ (off > 0.3) <= 1e-3 * areas.sum()


def test_among_samples_is_within_their_hull():
    """Samples themselves are; places a little farther out than the farthest are not."""
    atlas = half(explored("sphere").touches, 0.1, 0)
    table, membership = atlas.table, atlas.membership
    row = int(table.rows[atlas.open_outlines().any(axis=1)][0])
    points = membership.pool.points[membership.fitted[row]]
    assert supported(atlas, np.full(len(points), row), points, np.zeros(len(points))).all()
    along = (points - table.origin[row]) @ table.axes[row, 0]
    farther = points[along.argmax()] + 0.01 * table.radius[row] * table.axes[row, 0]
    assert not supported(atlas, np.array([row]), farther[None], np.zeros(1)).any()


def test_closed_surfaces_are_supported_everywhere():
    """No outline is open: far from all samples, too, the answer is yes."""
    atlas = explored("sphere").atlas
    far = np.full((1, 3), 1e3)
    assert supported(atlas, atlas.table.rows[:1], far, np.zeros(1)).all()


def test_one_touch_of_a_plane_draws_the_hexagon_of_its_arms():
    """Six arms of one, 60 degrees apart, have a hull of 3 sqrt(3) / 2; a disc of 0.98 is larger,
    and patches reach as far where trust has no end."""
    atlas = plane([(0, 0)])
    surface = extract_surface(atlas, 0.05)
    hexagon = 1.5 * np.sqrt(3.0)
    # The last of 7 steps is at the radius itself, where noise decides whether it is learned; and
    # whole triangles alone are drawn: along a rim of 6 up to an edge of 0.05 is left out.
    area = areas_of(surface.vertices, surface.faces).sum()
    assert hexagon * (6.0 / 7.0) ** 2 - 6.0 * 0.05 <= area <= hexagon
    atlas.options = replace(atlas.options, trust=np.inf)
    surface = extract_surface(atlas, 0.05)
    disc = areas_of(surface.vertices, surface.faces).sum()
    assert hexagon < disc <= np.pi * 0.98**2


def test_amid_others_the_surface_is_drawn_three_times_as_unsure_as_at_a_rim():
    """Deviations of two tolerances are too much at a rim, and cut no hole where all is covered."""
    whole = explored("sphere").atlas
    rows = whole.table.rows[:5]
    centres = whole.table.origin[rows]
    two, four = (np.full(5, factor * whole.tolerance) for factor in (2.0, 4.0))
    assert supported(whole, rows, centres, two).all()
    assert not supported(whole, rows, centres, four).any()
    part = half(explored("sphere").touches, 0.1, 0)
    rows = np.array(rim(part)[:5])
    assert not supported(part, rows, part.table.origin[rows], two).any()
