"""Refining: triangles stay a closed surface, come within the bound, and lie about the surface."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.faces.face_field import FaceValues
from touchatlas.atlas.mesh.refine import refined
from touchatlas.atlas.mesh.surface import Surface

AXES = np.array([1.0, 0.7, 0.5])


class Ellipsoid:
    """An ellipsoid and its field, to first order, and the number of points that it was asked."""

    def __init__(self, scale: float = 1.0) -> None:
        self.scale, self.asked, self.field = scale, 0, self

    def gaussian_curvature(self, points, face) -> np.ndarray:
        """That of x^2 / a^2 + y^2 / b^2 + z^2 / c^2 = 1 (do Carmo, section 3-3, exercise 21)."""
        axes = self.scale * AXES
        return (axes.prod() * ((points / axes**2) ** 2).sum(axis=1)) ** -2.0

    def at(self, points) -> FaceValues:
        self.asked += len(points)
        scaled = points / (self.scale * AXES)
        gradient = scaled / (self.scale * AXES)
        length, size = np.linalg.norm(scaled, axis=1), np.linalg.norm(gradient, axis=1)
        # (F - 1) / |grad F| with F the length of the scaled point.
        distance = (length - 1.0) * length / np.maximum(size, 1e-300)
        normal = gradient / np.maximum(size, 1e-300)[:, None]
        return FaceValues(distance, normal, np.zeros(len(points)), np.zeros(len(points), int))


def coarse(field: Ellipsoid) -> Surface:
    ball = trimesh.creation.icosphere(subdivisions=2)
    points = np.array(ball.vertices) * field.scale * AXES
    none, face = np.zeros(len(points)), np.zeros(len(points), int)
    return Surface(
        *(points, np.array(ball.faces), field.at(points).normal),
        *(none, face, field.gaussian_curvature(points, face)),
    )


def as_mesh(surface: Surface) -> trimesh.Trimesh:
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def distances(field: Ellipsoid, surface: Surface) -> np.ndarray:
    """Of vertices, middles of sides, centres and random points of triangles from the surface."""
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 4)
    weights = np.concatenate(
        [np.eye(3), 0.5 - 0.5 * np.eye(3), np.full((1, 3), 1.0 / 3.0), weights]
    )
    corners = surface.vertices[surface.faces]
    return np.abs(field.at(np.einsum("kc,fcd->kfd", weights, corners).reshape(-1, 3)).distance)


@pytest.mark.parametrize("bound", [4e-3, 1e-3])
def test_triangles_are_within_the_bound_of_the_surface(bound):
    """All but a few: an edge is asked in its middle alone. A closed surface stays closed."""
    field = Ellipsoid()
    found = refined(field, coarse(field), bound)
    mesh = as_mesh(found)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    off = distances(field, found)
    assert np.quantile(off, 0.99) < bound and off.max() < 1.5 * bound


def test_a_quarter_of_the_bound_takes_about_four_times_the_triangles():
    """Their number goes with one over the bound. Edges are halved, so that it goes in steps."""
    field = Ellipsoid()
    few, many = (len(refined(field, coarse(field), bound).faces) for bound in (2e-3, 5e-4))
    assert 3.0 < many / few < 6.0


def test_triangles_lie_about_the_surface():
    """Their volume errs by less than a third of that of triangles with vertices on the surface."""
    field = Ellipsoid()
    found = refined(field, coarse(field), 2e-3)
    volume = np.pi * 4.0 / 3.0 * AXES.prod()
    seen = field.at(found.vertices)
    inscribed = replace(found, vertices=found.vertices - seen.distance[:, None] * seen.normal)
    errors = [as_mesh(surface).volume - volume for surface in (inscribed, found)]
    assert errors[0] < 0.0 and abs(errors[1]) < abs(errors[0]) / 2.0
    # What vertices are moved counts as deviation.
    assert np.all(found.deviation >= 0.99 * np.abs(seen.distance))


def test_total_curvature_is_that_of_a_closed_surface():
    """Gauss-Bonnet; a triangle's area is off by its height over its radius, 2e-3 / 0.25 at most."""
    field = Ellipsoid()
    found = refined(field, coarse(field), 2e-3)
    assert found.total_curvature() == pytest.approx(4.0 * np.pi, rel=8e-3)


def test_what_is_near_enough_stays_as_it_is():
    """But for the vertices, which are moved out."""
    field = Ellipsoid()
    surface = coarse(field)
    found = refined(field, surface, 1.0)
    np.testing.assert_array_equal(found.faces, surface.faces)
    assert 0.0 < np.abs(found.vertices - surface.vertices).max() < 0.05


def test_the_field_is_asked_about_four_times_a_vertex():
    """Edges are thrice as many as vertices; twice at new vertices. Those that normals tell to be
    low are not asked."""
    field = Ellipsoid()
    surface = coarse(field)
    field.asked = 0
    found = refined(field, surface, 1e-3)
    assert field.asked < 5 * len(found.vertices)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_triangles_scale_with_the_unit(scale):
    one, other = Ellipsoid(), Ellipsoid(scale)
    first, second = (refined(f, coarse(f), 1e-3 * f.scale) for f in (one, other))
    np.testing.assert_array_equal(first.faces, second.faces)
    np.testing.assert_allclose(scale * first.vertices, second.vertices, atol=1e-9 * scale)
