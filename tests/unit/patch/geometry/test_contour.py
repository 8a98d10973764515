"""Contours with measured normals: points beside the plane, and the plane curve of those that need
one."""

import numpy as np
import pytest

from touchatlas.patch import Contour, ContourEnd, SamplingPlane

ENDS = (ContourEnd.LENGTH_REACHED,) * 2
ACROSS = np.array([0.0, 1.0, 0.0])


def _contacts_on_a_ball(tip: float = 2.0, radius: float = 30.0):
    """Contacts (20, 3) and normals (20, 3) of a ball tip whose centre stays in the plane y = 10."""
    angle = np.linspace(-0.4, 0.4, 20)
    circle = np.sqrt((radius + tip) ** 2 - 100.0)
    centres = np.stack([circle * np.sin(angle), 10.0 + 0 * angle, circle * np.cos(angle)], axis=1)
    normals = centres / (radius + tip)
    return centres - tip * normals, normals


def test_contacts_with_normals_are_learned_beside_their_plane():
    points, normals = _contacts_on_a_ball()
    plane = SamplingPlane([0.0, 10.0, 0.0], ACROSS)
    with_normals = Contour(points, plane, 0.01, ENDS, normals)
    without = Contour(points, plane, 0.01, ENDS)
    assert np.array_equal(without.learned_points(tip_radius=2.0), points)
    assert np.array_equal(with_normals.learned_points(), points)
    assert np.array_equal(without.learned_points()[:, 1], np.full(20, 10.0))


def test_contacts_reach_the_plane_in_their_tangent_planes():
    """The error is of second order: off^2 / 2R, at most 0.625^2 / 60 = 6.5e-3 over the squared
    sine 0.9 of the angle between both planes, where a projection is off by 0.625 * 10 / 32 = 0.2
    in the first order."""
    points, normals = _contacts_on_a_ball()
    plane = SamplingPlane([0.0, 10.0, 0.0], ACROSS)
    moved = Contour(points, plane, 0.01, ENDS, normals).points_in_plane
    assert np.abs(moved[:, 1] - 10.0).max() < 1e-12
    assert np.abs(np.linalg.norm(moved, axis=1) - 30.0).max() < 8e-3
    projected = Contour(points, plane, 0.01, ENDS).points_in_plane
    assert np.abs(np.linalg.norm(projected, axis=1) - 30.0).min() > 0.15


def test_a_repeated_point_is_left_out_with_its_normal():
    points, normals = _contacts_on_a_ball()
    twice = np.repeat(points, 2, axis=0)
    contour = Contour(twice, SamplingPlane(points[0], ACROSS), 0.01, ENDS, normals.repeat(2, 0))
    assert np.array_equal(contour.points, points) and np.array_equal(contour.normals, normals)


def test_normals_of_another_count_or_length_are_refused():
    points, normals = _contacts_on_a_ball()
    plane = SamplingPlane(points[0], ACROSS)
    with pytest.raises(ValueError, match="contour normals are 19, but there are 20 points"):
        Contour(points, plane, 0.01, ENDS, normals[1:])
    with pytest.raises(ValueError, match="contour normals differ from unit length by up to 1;"):
        Contour(points, plane, 0.01, ENDS, 2.0 * normals)
