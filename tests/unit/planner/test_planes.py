"""The sampling planes of a plan."""

import numpy as np
import pytest

from touchatlas.patch.geometry.curvature import curvatures_from_sections
from touchatlas.planner.planes import concurrent_planes


def test_planes_contain_the_normal_and_are_sixty_degrees_apart():
    rng = np.random.default_rng(0)
    point, normal = rng.normal(size=3), rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    planes = concurrent_planes(point, normal, rng.normal(size=3), 3)
    for i, plane in enumerate(planes):
        assert abs(plane.normal @ normal) < 1e-12
        assert abs(plane.normal @ planes[i - 1].normal) == pytest.approx(0.5, abs=1e-12)
    angles = np.pi / 3 * np.arange(3)
    assert curvatures_from_sections(np.zeros(3), angles, np.ones(3))[-1] == pytest.approx(2**0.5)
