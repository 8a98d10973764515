"""Outlines against their definition: on the polynomial, on the ball of the core, open or not."""

import numpy as np
import pytest

from tests.explored import explored, spread_touches
from touchatlas.atlas import Atlas
from touchatlas.atlas.graph.outlines import core_points
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN
from touchatlas.sim import make_object


@pytest.fixture(scope="module")
def atlas():
    return explored("torus", max_touches=25).atlas


def test_outline_lies_on_the_patch_and_on_the_ball_of_its_core(atlas):
    """At distance sqrt(weight) from the site and on the polynomial. The last of four secant steps
    changes the rise by far less than a thousandth of the core. The ball is met exactly."""
    table = atlas.table
    for row in table.rows.tolist():
        points, core = atlas.surface_graph.outlines.points([row])[0], np.sqrt(table.weight[row])
        assert points.shape == (24, 3)
        apart = np.linalg.norm(points - table.site[row], axis=1)
        assert apart == pytest.approx(core, rel=1e-3)
        assert np.abs(atlas.patch(row).signed_distance(points)).max() < 1e-3 * core


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_outlines_of_steep_patches_lie_on_them(seed):
    """A fixed point of the height overshoots where a patch is steep: it left outlines of these
    blobs 0.07, 0.13 and 0.14 radii off their patches."""
    body = make_object("blob")
    atlas = Atlas(body.tolerance)
    for touch in spread_touches(body, 14, body.noise_std, seed):
        atlas.add(touch)
    for row in atlas.table.rows.tolist():
        outline = atlas.surface_graph.outlines.points([row])[0]
        off = np.abs(atlas.patch(row).signed_distance(outline)).max()
        assert off < 0.01 * atlas.table.radius[row], row


def test_points_of_a_core_lie_on_the_patch_at_their_share_of_its_radius(atlas):
    """As outlines do, whose share is 1."""
    table, radii, angles = atlas.table, np.array([0.0, 0.3, 0.7]), np.array([0.5, 2.0, 4.0])
    for row in table.rows.tolist():
        points, core = (
            core_points(table, np.array([row]), radii, angles)[0],
            np.sqrt(table.weight[row]),
        )
        apart = np.linalg.norm(points - table.site[row], axis=1)
        assert apart == pytest.approx(radii * core, abs=1e-3 * core)
        assert np.abs(atlas.patch(row).signed_distance(points)).max() < 1e-3 * core


def test_outline_goes_round_counter_clockwise_from_outside(atlas):
    """The 24 points turn once about the normal, 15 degrees apart as seen from the site."""
    table = atlas.table
    for row in table.rows.tolist():
        points = atlas.surface_graph.outlines.points([row])[0]
        x, y = ((points - table.site[row]) @ table.axes[row, :2].T).T
        turn = np.diff(np.unwrap(np.arctan2(y, x)), append=np.arctan2(y[0], x[0]) + 2.0 * np.pi)
        assert np.mod(turn, 2.0 * np.pi) == pytest.approx(np.pi / 12.0, abs=0.02)


def test_outline_is_open_where_no_neighbours_power_is_below_the_margin(atlas):
    """One point at a time, and one neighbour at a time."""
    table, found = atlas.table, atlas.open_outlines()
    assert 0.1 < found.mean() < 0.9
    for row, flags in zip(table.rows.tolist(), found, strict=True):
        points = atlas.surface_graph.outlines.points([row])[0]
        for point, is_open in zip(points, flags, strict=True):
            covered = False
            for j in atlas.neighbours[row]:
                power = np.sum((point - table.site[j]) ** 2) - table.weight[j]
                covered |= bool(power <= CELL_MARGIN * table.weight[j])
            assert is_open != covered
