"""Refining: triangles stay a closed surface, come within the bound, and lie about the surface."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.lawful import known_body, rounded_box_distance
from tests.lawful_meshes import BLUNT, RADIUS
from touchatlas.atlas.field.face_field import FaceValues
from touchatlas.atlas.mesh.refine import edges_of, refined, triangles_beside
from touchatlas.atlas.mesh.surface import body_surface, with_curvatures
from touchatlas.atlas.records.surface import Surface
from touchatlas.patch.geometry.normal_error import SURE

AXES = np.array([1.0, 0.7, 0.5])


class Ellipsoid:
    """An ellipsoid and its field, to first order, and the number of points that it was asked."""

    is_one_face = True

    def __init__(self, scale: float = 1.0) -> None:
        self.scale, self.asked, self.field, self.extent = scale, 0, self, 2.0 * scale

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
    return Surface(points, np.array(ball.faces), field.at(points).normal, none, face, none)


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
    mesh = found.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    off = distances(field, found)
    assert np.quantile(off, 0.99) < bound and off.max() < 1.5 * bound


def test_the_deviation_takes_in_how_far_triangles_are():
    """Of triangles about a surface that is known exactly, 95 % lie within 1.96 of it."""
    field = Ellipsoid()
    found = refined(field, coarse(field), 4e-3)
    assert share_within(found, lambda points: field.at(points).distance) > 0.95


def test_the_deviation_takes_in_chords_of_bent_faces_with_edges():
    """Vertices stay on these, and triangles are chords. The planes of the cylinder have none."""
    body, bound = known_body("cylinder", 20), 0.2
    found = refined(body, body_surface(body, 4.0), bound)
    level = np.abs(np.abs(found.normals[:, 2]) - 1.0) < 1e-3
    predicted = body.field.at(found.vertices).deviation
    assert np.median(found.deviation[level] / predicted[level]) < 1.1
    assert np.median(found.deviation[~level]) > 2.0 * np.median(predicted[~level])
    side = found.only(~level)
    assert share_within(side, lambda points: body.field.at(points).distance) > 0.95


def share_within(surface: Surface, distance) -> float:
    """Fraction of random points of triangles that are within 1.96 deviations by ``distance``."""
    points, face = trimesh.sample.sample_surface(surface.to_trimesh(), 5000, seed=0)
    deviation = surface.deviation[surface.faces[face]].mean(axis=1)
    return float((np.abs(distance(points)) <= SURE * deviation).mean())


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
    errors = [surface.to_trimesh().volume - volume for surface in (inscribed, found)]
    assert errors[0] < 0.0 and abs(errors[1]) < abs(errors[0]) / 2.0
    # What vertices are moved counts as deviation.
    assert np.all(found.deviation >= 0.99 * np.abs(seen.distance))


def test_total_curvature_is_that_of_a_closed_surface():
    """Gauss-Bonnet; a triangle's area is off by its height over its radius, 2e-3 / 0.25 at most."""
    field = Ellipsoid()
    found = refined(field, coarse(field), 2e-3)
    found = with_curvatures(field, found)
    assert found.total_curvature() == pytest.approx(4.0 * np.pi, rel=8e-3)


def test_what_is_near_enough_stays_as_it_is():
    """But for the vertices, which are moved out."""
    field = Ellipsoid()
    surface = coarse(field)
    found = refined(field, surface, 1.0)
    np.testing.assert_array_equal(found.faces, surface.faces)
    assert 0.0 < np.abs(found.vertices - surface.vertices).max() < 0.05


def test_the_circles_at_the_ends_of_a_cylinder_are_refined_with_its_side():
    """The field is zero all over the end: only both faces together tell that a chord of the circle
    is off. In cubes of an eighth of the radius chords are off by 2e-3 radii, 16 bounds."""
    body, bound = known_body("cylinder", 30), 1.25e-4 * RADIUS
    drawn = body_surface(body, RADIUS / 8.0)
    found = refined(body, drawn, bound)
    mesh = found.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    assert _off_circles(body, drawn).max() > 10.0 * bound
    assert _off_circles(body, found).max() < bound


def _off_circles(body, surface) -> np.ndarray:
    """Distances of the middles of edges at which triangles turn from the farther of two faces."""
    ends, sides = edges_of(surface.faces)
    normals = surface.to_trimesh().face_normals[triangles_beside(sides, len(ends))]
    middles = surface.vertices[ends[normals.prod(axis=1).sum(axis=1) < 0.5]].mean(axis=1)
    # The third face is the other end of the cylinder.
    return np.sort(np.abs(body.field.trees.all_distances(middles)), axis=1)[:, 1]


def test_a_rounding_narrower_than_the_cubes_is_refined():
    """In cubes of one and a half of its radius the corners of a box with rounded edges are cut off
    by more than a third of a radius."""
    body = known_body("rounded", 34)
    drawn = body_surface(body, 1.5 * BLUNT)
    found = refined(body, drawn, 0.02 * BLUNT)
    before, after = (
        np.abs(rounded_box_distance(_random_points(s, 50_000))) for s in (drawn, found)
    )
    assert before.max() > 0.3 * BLUNT
    # The radii are known to a twentieth, and a corner of a ball leaves a box by 0.7 radii.
    assert after.max() < 0.1 * BLUNT


def _random_points(surface, count: int) -> np.ndarray:
    """Random points (n, 3) of a surface."""
    return trimesh.sample.sample_surface(surface.to_trimesh(), count, seed=0)[0]
