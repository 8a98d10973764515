"""Contours with measured normals: points beside the plane, and the plane curve of those that need
one."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.patch import Contour, ContourEnd, SamplingPlane, fit_patch
from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.patch.geometry.section import fit_sections

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


def test_contacts_of_a_large_ball_may_lie_far_off_their_plane():
    """As far as their normals lean: 40 r (n . w) of a ball of 40. Of another plane they are not."""
    points, normals = _contacts_on_a_ball(tip=40.0, radius=3.0)
    plane = SamplingPlane([0.0, 10.0, 0.0], ACROSS)
    assert np.abs(points[:, 1] - 10.0).min() > 9.0
    Contour(points, plane, 0.01, ENDS, normals)
    with pytest.raises(ValueError, match="off their sampling plane"):
        Contour(points, SamplingPlane([0.0, 10.0, 0.0], np.eye(3)[0]), 0.01, ENDS, normals)


def _oblique_contours():
    """Contours of contacts of a tip of 6 on a ball of 30, about (0, 0, 30), in three planes that
    lean by 30 degrees from the normal there."""
    contours, up = [], np.array([0.0, 0.0, 1.0])
    for turn in np.deg2rad([0.0, 60.0, 120.0]):
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        level = np.cross(up, along)
        across = np.cos(np.pi / 6) * level + np.sin(np.pi / 6) * up
        middle = (36.0 * up @ across) * across
        radius = np.sqrt(36.0**2 - middle @ middle)
        outward = (36.0 * up - middle) / radius
        angle = np.linspace(-0.3, 0.3, 25)[:, None]
        centres = middle + radius * (np.cos(angle) * outward + np.sin(angle) * along)
        normals = centres / 36.0
        plane = SamplingPlane(30.0 * up, across)
        contours.append(Contour(centres - 6.0 * normals, plane, 1e-4, ENDS, normals))
    return contours


def test_contacts_with_normals_give_the_curvature_at_the_reference_point():
    """Of the plane curve, by Meusnier, and of the patch, to 1 %."""
    top = np.array([0.0, 0.0, 30.0])
    for fit in fit_sections(top, _oblique_contours(), 1e-4):
        assert fit.curvature_vector[2] == pytest.approx(-1.0 / 30.0, rel=0.01)
    patch = fit_patch(top, _oblique_contours(), np.array([0.0, 0.0, 1.0])).patch
    assert patch.curvatures.k1 == pytest.approx(-1.0 / 30.0, rel=0.01)
    assert patch.curvatures.k2 == pytest.approx(-1.0 / 30.0, rel=0.01)


def test_a_bad_contact_is_left_out_with_its_normal():
    [contour, *_] = _oblique_contours()
    points = contour.points.copy()
    points[7] += 1.0
    kept = without_bad_contacts(replace(contour, points=points))
    assert len(kept.points) == len(kept.normals) == 24
    assert np.array_equal(kept.normals, np.delete(contour.normals, 7, axis=0))


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
