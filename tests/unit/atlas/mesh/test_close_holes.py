"""Small holes are closed, counted and doubted; true rims stay open."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.meshes import euler_number, surface_of
from touchatlas.atlas.mesh.mend import close_holes, error_across, slope_of_rim
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool

RADIUS = 50.0
NO_RIMS = Rims(SamplePool())


def ball() -> Surface:
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
    return replace(surface_of(mesh, 1e-3, RADIUS**-2), normals=mesh.vertices / RADIUS)


def pierced(*directions, width: float) -> Surface:
    """The ball without what is near some points of it."""
    whole = ball()
    far = [
        np.linalg.norm(whole.vertices - RADIUS * np.array(d), axis=1) > width for d in directions
    ]
    return whole.only(np.all(far, axis=0))


def test_small_holes_are_closed_on_the_sphere():
    open_ball = pierced([1.0, 0.0, 0.0], [0.0, 0.6, 0.8], width=5.0)
    assert euler_number(open_ball) == 0
    closed = close_holes(open_ball, NO_RIMS)
    mesh = closed.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    assert len(closed.closed_holes) == 2
    # Edges are as bent as the sphere, to fourth order. Those of the ball are 2.1
    # long at most: (2 (5 + 2.1))^4 / (128 R^3) = 2.54e-3.
    heights = np.linalg.norm(closed.closed_holes, axis=1) - RADIUS
    assert np.abs(heights).max() < 2.55e-3
    # A tenth of the way to the rim in the middle of the widest edge.
    deviation = closed.deviation[len(open_ball.vertices) :]
    assert 0.4 < deviation.max() < 0.7


def test_a_wide_opening_stays_open():
    wide = pierced([0.0, 0.0, 1.0], width=20.0)
    assert close_holes(wide, NO_RIMS) is wide


def test_the_size_of_a_hole_is_a_fraction_of_the_surface():
    small = pierced([0.0, 0.0, 1.0], width=5.0)
    whole = close_holes(Surface(*(1e3 * small.vertices, *list(vars(small).values())[1:])), NO_RIMS)
    assert len(whole.closed_holes) == 1


def test_the_error_across_a_hole_of_a_ball_is_the_height_of_its_cap():
    """A cap of angle t over a rim of radius r is r tan(t / 2) high; a slope of a tenth is borne."""
    around = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    for angle in np.deg2rad([5.0, 30.0, 60.0, 90.0]):
        rim = np.sin(angle) * np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
        normals = rim + [0.0, 0.0, np.cos(angle)]
        assert slope_of_rim(rim + 5.0, normals) == pytest.approx(np.sin(angle), rel=1e-12)
        high = max(1.0 - np.cos(angle), 0.196 * np.sin(angle))
        # 1.96 stands for the 95th percentile, to 2e-5.
        assert error_across(np.sin(angle), np.sin(angle)) == pytest.approx(high, rel=1e-4)


def test_the_end_of_a_finger_is_closed_with_the_deviation_of_half_a_ball():
    """What no touch has met may end flat or go on: it is off by its radius at 95 %."""
    finger = trimesh.creation.capsule(height=100.0, radius=2.0, count=[64, 64])
    whole = surface_of(finger, 1e-3)
    without_tip = whole.only(finger.vertices[:, 2] < finger.vertices[:, 2].max() - 1.95)
    closed = close_holes(without_tip, NO_RIMS)
    deviation = closed.deviation[len(without_tip.vertices) :]
    assert deviation.max() == pytest.approx(2.0 / 1.96, rel=0.1)
