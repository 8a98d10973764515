"""Curves and faces bent onto a ball, whose best fits are known."""

import numpy as np
import pytest

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball, ball_of, cube_quads
from touchatlas.atlas.cad.bezier.bezier import curve_points, face_normals, face_points
from touchatlas.atlas.cad.bezier.bezier_tree import first_tree
from touchatlas.atlas.cad.bezier.fit_bezier import fit_curves

T = np.linspace(0.0, 1.0, 33)


def quarter(radius: float) -> np.ndarray:
    """(1, 4, 3) a curve from one axis to the next that runs along the tangents, too short."""
    x, y = radius * np.eye(3)[:2]
    return np.array([[x, x + 0.4 * y, y + 0.4 * x, y]])


def fitted_quarter(radius: float) -> np.ndarray:
    return fit_curves(quarter(radius), ball_of(radius), np.eye(3)[None, :2])[0]


def test_a_quarter_of_a_circle_errs_as_little_as_a_cubic_can():
    """The best cubic with the tangents of the circle is off by 2.0e-4 radii (Goldapp 1991)."""
    off, _ = ball(curve_points(fitted_quarter(RADIUS), T))
    assert np.abs(off).max() < 3e-4 * RADIUS
    before, _ = ball(curve_points(quarter(RADIUS)[0], T))
    assert np.abs(before).max() > 3e-2 * RADIUS


def test_a_curve_keeps_its_ends_and_is_tangent_to_the_surface_there():
    found, (x, y) = fitted_quarter(RADIUS), RADIUS * np.eye(3)[:2]
    assert (found[0] == x).all() and (found[-1] == y).all()
    assert abs((found[1] - found[0]) @ x) < 1e-3 * RADIUS**2


def test_scaled_curves_are_fitted_alike():
    assert fitted_quarter(1e-3 * RADIUS) == pytest.approx(1e-3 * fitted_quarter(RADIUS), rel=1e-9)


def test_faces_of_a_ball_are_near_and_tangent_to_it():
    """Six faces; as many plane ones would be off by 0.4 radii and 55 degrees."""
    tree = first_tree(*cube_quads(), ball, 3)
    u, v = (x.ravel() for x in np.meshgrid(T, T))
    points = face_points(np.array(tree.controls), u, v).reshape(-1, 3)
    off, normal = ball(points)
    assert np.abs(off).max() < 3e-3 * RADIUS
    cosine = (face_normals(np.array(tree.controls), u, v).reshape(-1, 3) * normal).sum(axis=1)
    assert np.degrees(np.arccos(cosine.min())) < 2.0
