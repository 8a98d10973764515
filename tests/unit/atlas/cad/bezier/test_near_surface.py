"""NearSurface: the field where it is near the triangles, and the triangles elsewhere."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball_of, surface_of
from touchatlas.atlas.cad.bezier.near_surface import NearSurface

NEAR = 0.1


def near_surface(radius: float) -> NearSurface:
    """The field of a ball of a radius, and triangles of one of ``RADIUS``."""

    def at(points):
        distance, normal = ball_of(radius)(points)
        return SimpleNamespace(distance=distance, normal=normal)

    surface = surface_of(trimesh.creation.icosphere(5, RADIUS))
    return NearSurface(SimpleNamespace(at=at), surface, NEAR)


@pytest.fixture
def points():
    return 1.02 * RADIUS * trimesh.creation.icosphere(3, 1.0).vertices


@pytest.mark.parametrize(
    ("radius", "wanted"), [(RADIUS, RADIUS), (RADIUS + 0.5 * NEAR, RADIUS + 0.5 * NEAR)]
)
def test_a_field_near_the_triangles_decides(points, radius, wanted):
    distance, normal = near_surface(radius).at(points)
    assert distance == pytest.approx(1.02 * RADIUS - wanted, abs=2e-4)
    assert normal == pytest.approx(points / np.linalg.norm(points, axis=1)[:, None], abs=1e-2)


def test_triangles_far_from_the_field_decide(points):
    """A triangle of this ball is 4e-3 within it."""
    distance, normal = near_surface(RADIUS + 3.0 * NEAR).at(points)
    assert distance == pytest.approx(0.02 * RADIUS, abs=1e-2)
    assert normal == pytest.approx(points / np.linalg.norm(points, axis=1)[:, None], abs=1e-2)
