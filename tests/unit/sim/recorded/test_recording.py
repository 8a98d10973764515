"""What is made of curves: where they meet, their planes, arcs and noise."""

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, ball_height, graph_contours
from touchatlas.patch import ContourEnd
from touchatlas.patch.fit.curve_noise import estimate_noise
from touchatlas.sim.recorded.arcs import near_arc
from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.recording import prepare
from touchatlas.sim.recorded.reference_point import meeting_point


def curves_of(contours, planes=False):
    return [
        Curve(name, c.points, c.plane.normal if planes else None)
        for name, c in zip("abcdefgh", contours, strict=False)
    ]


def ball_curves(noise=0.02, count=25, reach=12.0, seed=0, **more):
    rng = np.random.default_rng(seed)
    return curves_of(graph_contours(ball_height, reach, count, noise, rng, **more))


def test_meeting_point_of_a_ball_is_on_the_curves():
    assert meeting_point([c.points for c in ball_curves(0.0)]) == pytest.approx(0.0, abs=1e-9)


def test_height_of_the_meeting_point_comes_from_the_samples():
    """All planes hold the z axis: only the curves tell how high they cross."""
    curves = [Curve(c.name, c.points + [0.0, 0.0, 5.0], c.normal) for c in ball_curves()]
    # Three nearest points, each off by 0.02.
    assert prepare(curves).point == pytest.approx([0.0, 0.0, 5.0], abs=4 * 0.02)


def test_estimated_noise_is_the_noise():
    for noise in (0.002, 0.02):
        contours = graph_contours(ball_height, 12.0, 101, noise, np.random.default_rng(1))
        points, normals = zip(*((c.points, c.plane.normal) for c in contours), strict=True)
        assert estimate_noise(points, normals) == pytest.approx(noise, rel=0.15)
        spoilt = tuple(p + 50 * noise * (np.arange(101) == 30)[:, None] for p in points)
        assert estimate_noise(spoilt, normals) == pytest.approx(noise, rel=0.2)


def test_points_closer_together_than_the_noise_estimate_it_too():
    contours = graph_contours(ball_height, 12.0, 10_001, 0.05, np.random.default_rng(1))
    points, normals = zip(*((c.points, c.plane.normal) for c in contours), strict=True)
    assert estimate_noise(points, normals) == pytest.approx(0.05, rel=0.02)


def test_z_in_another_unit_is_said_in_one_sentence():
    stretched = [Curve(c.name, c.points * [1, 1, 1000], None) for c in ball_curves()]
    with pytest.raises(ValueError, match="see whether z has another unit: it spans .* as x and y"):
        prepare(stretched)


def test_the_curve_without_which_the_others_meet_is_named_and_none_where_none_is():
    curves = ball_curves()
    for k in range(3):
        apart = list(curves)
        apart[k] = Curve("far", curves[k].points + [20.0, 10.0, 60.0], None)
        with pytest.raises(ValueError, match="without curve 'far' the others meet"):
            prepare(apart)
    parted = [
        Curve(c.name, c.points + 60.0 * axis, None)
        for c, axis in zip(curves, np.eye(3), strict=True)
    ]
    with pytest.raises(ValueError, match="leaving out no single curve mends that"):
        prepare(parted)


def test_a_single_bad_contact_does_not_cut_a_curve():
    points = ball_curves()[0].points.copy()
    points[7] += [0.0, 0.0, 8.0]
    assert len(near_arc(points, np.zeros(3))[0]) == len(points)


def test_a_curve_that_misses_the_point_is_refused():
    curves = ball_curves()
    away = Curve("far", curves[2].points + [0.0, 60.0, 0.0], None)
    with pytest.raises(ValueError, match="one passes .* away from .* without curve 'far'"):
        prepare([*curves[:2], away])


def test_fitted_planes_are_the_sampling_planes():
    rng = np.random.default_rng(2)
    contours = graph_contours(ball_height, 12.0, 41, 0.0, rng, tilt=0.3)
    for found, true in zip(prepare(curves_of(contours)).contours, contours, strict=True):
        assert abs(found.plane.normal @ true.plane.normal) == pytest.approx(1.0, abs=1e-9)


def test_a_straight_curve_takes_the_plane_of_the_surface_normal():
    contours = graph_contours(lambda x, y: -0.01 * y * y, 10.0, 21, 0.0, np.random.default_rng(3))
    straight = prepare(curves_of(contours)).contours[0]
    assert abs(straight.plane.normal @ [0.0, 1.0, 0.0]) == pytest.approx(1.0, abs=1e-6)


def test_great_circles_are_cut_where_they_turn_by_45_degrees():
    angle = np.linspace(0.0, 2.0 * np.pi, 181)[:, None] + 1.0
    curves = []
    for name, a in zip("abc", np.pi / 3 * np.arange(3), strict=True):
        across = np.array([np.cos(a), np.sin(a), 0.0])
        circle = BALL_RADIUS * (np.sin(angle) * across + np.cos(angle) * [0.0, 0.0, 1.0])
        curves.append(Curve(name, np.append(circle[:-1], circle[:1], axis=0), None))
    top = np.array([0.0, 0.0, BALL_RADIUS])
    found = prepare(curves, 0.0, top)
    assert found.flags == ("curves cut",)
    for contour in found.contours:
        turn = np.arccos(contour.points[:, 2] / BALL_RADIUS)
        assert turn[[0, -1]] == pytest.approx(np.pi / 4, abs=np.deg2rad(2.1))
        assert contour.ends == (ContourEnd.TURNED_AWAY,) * 2


def test_a_curve_that_starts_at_the_point_is_flagged_and_does_not_end_the_patch():
    points = ball_curves(count=41)[0].points[20:]
    arc, ends = near_arc(points, np.zeros(3))
    assert len(arc) == 21 and ends == (ContourEnd.UNREACHABLE, ContourEnd.LENGTH_REACHED)
    curves = [Curve("h", points, None), *ball_curves()[1:], *ball_curves(angles=[0.5])]
    assert "one-sided curves" in prepare(curves).flags


def test_curves_that_miss_each_other_are_flagged():
    curves = ball_curves()
    assert prepare(curves, 0.02).flags == ()
    apart = [Curve(c.name, c.points + [0.0, 0.0, k], None) for k, c in enumerate(curves)]
    assert "curves do not meet" in prepare(apart, 0.02).flags


def test_a_curve_off_its_plane_is_flagged():
    first, *others = ball_curves()
    s = np.linspace(-1.0, 1.0, len(first.points))
    bent = first.points + np.outer(s**3, [0.0, 2.0, 0.0])
    curves = [Curve("a", bent, np.array([0.0, 1.0, 0.0])), *others]
    assert "curves not planar" in prepare(curves, 0.02).flags


def test_short_and_nameless_curves_are_scattered_contacts_near_the_point():
    contacts = np.array([[3.0, 1.0, -0.15], [100.0, 0.0, 0.0]])
    short = ball_curves(count=3, reach=9.0)[0].points
    curves = [*ball_curves(), Curve("", contacts, None), Curve("s", short, None)]
    found = prepare(curves)
    assert found.names == ("a", "b", "c")
    assert found.scattered == pytest.approx(np.concatenate([contacts[:1], short]))


@pytest.mark.parametrize(
    ("curves", "noise", "point", "words"),
    [
        (ball_curves()[:2], None, None, "only 2 curves have 5 or more distinct points (a: 25, b"),
        ([Curve("", np.eye(3), None)], None, None, "no curve has 5 or more"),
        (ball_curves(angles=[0.0, 0.01, 0.02]), None, None, "nearly one direction"),
        (ball_curves(), None, [90.0, 0.0, 0.0], "away from all curves"),
        (ball_curves(), None, [1e300, 0.0, 0.0], "1e+300 away from all curves"),
        (ball_curves(), -1.0, None, "noise is -1.0"),
        (ball_curves(), 1e300, None, "but the curves are only"),
        (ball_curves(), np.nan, None, "noise is nan"),
    ],
)
def test_curves_that_cannot_be_fitted_are_refused(curves, noise, point, words):
    with pytest.raises(ValueError) as refusal:
        prepare(curves, noise, point)
    assert words in str(refusal.value)
