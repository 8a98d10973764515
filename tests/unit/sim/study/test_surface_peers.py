"""Peers on whole surfaces: each knows a ball; helpers keep what they promise."""

import os
import runpy
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.study.surface_peers import Peer, best_surface, spread, spread_plans
from touchatlas.sim.world.objects import make_object

EXAMPLE = Path(__file__).parents[4] / "examples" / "surface_peers.py"
with patch.dict(os.environ):
    NAMES = runpy.run_path(str(EXAMPLE))
PEERS, zero_set = NAMES["METHODS"], NAMES["zero_set"]
exact_normals, pca_normals = NAMES["exact_normals"], NAMES["pca_normals"]
RADIUS = 33.0


@pytest.fixture(scope="module")
def ball():
    """Even points of a ball and its normals."""
    normals = np.random.default_rng(0).normal(size=(6000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals = normals[spread(normals, 1200)]
    return RADIUS * normals, normals


@pytest.mark.parametrize("name", PEERS)
def test_peer_reconstructs_a_ball(name, ball):
    peer = PEERS[name]
    if not peer.present():
        pytest.skip(f"{peer.package} cannot be imported")
    (vertices, faces), setting, seconds = best_surface(peer, *ball, 0.0, 24, ball[0])
    error = np.linalg.norm(vertices, axis=1) / RADIUS - 1.0
    assert np.abs(error).max() < 0.01
    assert ClosestPoints(vertices, faces)(ball[0])[0].max() < 0.01 * RADIUS
    assert setting in peer.settings
    assert seconds > 0.0


def test_zero_set_is_closed_and_looks_outward(ball):
    points = ball[0]
    vertices, faces = zero_set(lambda x: np.linalg.norm(x, axis=1) - RADIUS, points, 24)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    volume = (np.cross(a, b) * c).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS**3, rel=0.01)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_best_setting_is_the_one_nearest_the_truth(ball):
    def shell(points, normals, setting, noise_std, cells):
        if setting == 0.0:
            raise RuntimeError
        return zero_set(lambda x: np.linalg.norm(x, axis=1) - setting * RADIUS, points, cells)

    peer = Peer(shell, (0.0, 1.01, 1.0), "numpy")
    assert best_surface(peer, *ball, 0.0, 24, ball[0])[1] == 1.0
    assert best_surface(Peer(shell, (0.0,) * 3, "numpy"), *ball, 0.0, 24, ball[0]) is None


def test_absent_package_is_noticed():
    assert not Peer(zero_set, (), "no_such_package").present()


def test_normals_by_components_and_exact_ones_agree_on_even_points():
    obj = make_object("torus")
    points, normals = obj.sample(4000, np.random.default_rng(0))
    exact = exact_normals(obj, points)
    assert np.abs(exact - normals).max() < 1e-9
    found, seconds = pca_normals(points, exact, exact)
    assert np.median((found * exact).sum(axis=1)) > 0.999
    assert seconds > 0.0


def test_plans_lie_spread_over_the_object():
    obj = make_object("sphere")
    points, normals = obj.sample(2000, np.random.default_rng(0))
    plans = spread_plans(points, normals, 12)
    places = np.array([plan.reference_point for plan in plans])
    gaps = np.linalg.norm(places[:, None] - places, axis=2) + 99.0 * np.eye(12)
    assert gaps.min() > 0.8 * RADIUS
    assert all(abs(plane.normal @ plan.normal) < 1e-12 for plan in plans for plane in plan.planes)
