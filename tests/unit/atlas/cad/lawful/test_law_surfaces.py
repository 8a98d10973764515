"""Surfaces with a name in STEP: their distances, and where their seams are."""

from types import SimpleNamespace

import numpy as np
import pytest

from touchatlas.atlas.cad.lawful.fit_cone import Cone, cone_distances
from touchatlas.atlas.cad.lawful.law_surfaces import LawSurface, law_surface

TURNED = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])


@pytest.mark.parametrize("kind", ["plane", "cylinder", "cone", "sphere"])
@pytest.mark.parametrize("outward", [1.0, -1.0])
def test_the_normal_is_the_way_in_which_the_distance_grows(kind, outward):
    angle = 0.4 if kind == "cone" else 0.0
    way = 1.0 if kind == "plane" else outward
    surface = LawSurface(kind, np.array([3.0, -1.0, 2.0]), TURNED, 2.0, way, angle)
    points = surface.origin + np.random.default_rng(0).uniform(0.5, 1.5, (50, 3)) @ TURNED
    distance, normal = surface.at(points)
    moved, same = surface.at(points + 0.01 * normal)
    assert moved - distance == pytest.approx(0.01, abs=1e-12)
    assert same == pytest.approx(normal, abs=1e-12)


def face(kind, numbers, normals):
    """A face of a law, whose piece has normals (n, 3)."""
    piece = SimpleNamespace(at=lambda points: (np.zeros(len(points)), normals))
    return SimpleNamespace(kind=kind, law=SimpleNamespace(numbers=numbers), pieces=[piece])


def test_the_seam_of_a_cylinder_is_amid_the_widest_gap_of_its_samples():
    """A quarter is missing about an angle of 2."""
    angle = 2.0 + np.linspace(0.25, 1.75, 50) * np.pi
    away = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    numbers = {"axis": [0.0, 0.0, 1.0], "point": [1.0, 0.0, 0.0], "radius": 2.0}
    points = np.array([1.0, 0.0, 0.0]) + 2.0 * away
    found = law_surface(face("cylinder", numbers, -away), points)
    assert found is not None and found.outward == -1.0
    assert found.axes[0] == pytest.approx([np.cos(2.0), np.sin(2.0), 0.0], abs=1e-12)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)


@pytest.mark.parametrize("lowest", [0.1, -0.5])
def test_the_seam_of_a_sphere_is_opposite_of_a_cap_or_through_its_pole(lowest):
    """A cap of less than half of a sphere has no seam at all."""
    angle, height = np.meshgrid(np.arange(12) / 6.0 * np.pi, np.linspace(lowest, 0.95, 6))
    away = np.sqrt(1.0 - height**2)
    points = np.column_stack(
        [c.ravel() for c in (away * np.cos(angle), away * np.sin(angle), height)]
    )
    numbers = {"centre": [0.0, 0.0, 0.0], "radius": 1.0}
    found = law_surface(face("sphere", numbers, points), points)
    assert found is not None
    pole = 2 if lowest < 0.0 else 0
    assert np.abs(found.axes[pole]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)


def test_distances_from_a_cone_are_along_its_normals():
    cone = Cone(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.pi / 4.0)
    points = np.array([[1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert cone_distances(cone, points) == pytest.approx([0.0, np.sqrt(2.0), -np.sqrt(0.5)])
