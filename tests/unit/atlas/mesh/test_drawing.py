"""The surface of lawful faces: closed, sharp, and as near as is asked for."""

from itertools import product

import numpy as np
import pytest

from tests.lawful import NOISE, body_of, box_distance, known_body, samples_of_touches, touched_mesh
from tests.lawful_meshes import BLUNT, HALF, HALF_HEIGHT, RADIUS
from touchatlas.atlas.mesh.surface import body_surface, coarse_edge, fine_edge, with_curvatures

# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE


@pytest.fixture(scope="module")
def box():
    return known_body("box", 40)


@pytest.fixture(scope="module")
def cylinder():
    return known_body("cylinder", 30)


def test_a_box_touched_all_over_is_closed_sharp_and_as_near_as_predicted(box):
    """The noise of six planes is normal: three deviations hold each with a chance of 0.997. A
    corner is where three planes meet at right angles, so the square of its error is their sum."""
    surface = with_curvatures(box, body_surface(box, coarse_edge(box)))
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    off = np.abs(box_distance(surface.vertices))
    assert np.all(off <= 3.0 * surface.deviation + 1e-9)
    assert surface.deviation.max() < NOISE
    corners = np.array(list(product(*zip(-HALF, HALF, strict=True))))
    missed = np.linalg.norm(corners[:, None] - surface.vertices, axis=2).min(axis=1)
    assert missed.max() < 3.0 * np.sqrt(3.0) * surface.deviation.max()
    assert np.all(surface.gaussian_curvature == 0.0)
    # The patch is the face.
    assert set(surface.patch) == set(range(6))


@pytest.mark.parametrize("sagitta", [0.05, 0.02])
def test_triangles_of_a_cylinder_are_within_the_sagitta_that_is_asked_for(cylinder, sagitta):
    """They are chords, on the inner side. The touched mesh itself is 1.5e-3 within its circle."""
    surface = body_surface(cylinder, fine_edge(cylinder, sagitta))
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2
    edges = surface.vertices[mesh.edges_unique].mean(axis=1)
    points = np.concatenate([edges, mesh.triangles_center])
    side = np.hypot(points[:, 0], points[:, 1]) - RADIUS
    distance = np.maximum(side, np.abs(points[:, 2]) - HALF_HEIGHT)
    off = 3.0 * surface.deviation.max()
    assert distance.max() < off
    assert distance.min() > -sagitta - off - 1.5e-3


def test_the_edge_of_cubes_follows_the_square_root_of_the_sagitta(cylinder, box):
    """Between the coarse edge and the most cubes, a 32nd and a 160th of the extent; planes do not
    bend."""
    assert fine_edge(cylinder, 0.01) == pytest.approx(0.5 * fine_edge(cylinder, 0.04), rel=1e-12)
    assert fine_edge(cylinder, 1e3) == coarse_edge(cylinder) == cylinder.extent / 32
    assert fine_edge(cylinder, 1e-9) == cylinder.extent / 160
    assert fine_edge(box, 1e-9) == coarse_edge(box)


def test_each_side_of_a_thin_wall_has_its_own_cubes():
    plate = body_of(samples_of_touches(touched_mesh("plate", 40, 0.0), 1e-6))
    assert coarse_edge(plate) == pytest.approx(0.4 * plate.thickness, rel=1e-12)


def test_the_surface_ends_where_nothing_was_touched():
    """Samples to x = 5: no vertex is beyond by more than a step and a half and a cube."""
    columns = touched_mesh("box", 60, NOISE, 4)
    body = body_of(samples_of_touches(columns, STD, columns[0][:, 0] < 5.0))
    edge = coarse_edge(body)
    surface = body_surface(body, edge)
    mesh = surface.to_trimesh()
    assert not mesh.is_watertight and mesh.is_winding_consistent
    assert surface.vertices[:, 0].max() < 5.0 + 1.5 + edge
    # One open rim: the body is a disk.
    assert mesh.euler_number == 1


def test_the_total_curvature_of_a_rounded_box_is_that_of_a_ball():
    """Gauss-Bonnet: 4 pi, all of it on the balls of the corners. Where the edges of a corner have
    radii that differ by a few hundredths, the ball has their mean: that is two in a hundred."""
    body = known_body("rounded", 34)
    surface = with_curvatures(body, body_surface(body, 0.5 * BLUNT))
    assert surface.to_trimesh().euler_number == 2
    assert surface.total_curvature() == pytest.approx(4.0 * np.pi, rel=0.02)
