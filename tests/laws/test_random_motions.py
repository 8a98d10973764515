"""Laws of a patch and of a small atlas, over motions, units, reflections and orders at random."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.laws.patch_scenes import NOISE, contours_of, fit_of, scene_of
from tests.truths import UP, moved, moved_touch, quadric_height
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, SamplingPlane, fit_patch
from touchatlas.sim.study.cases import random_rotation

FEW = settings(max_examples=12, derandomize=True, deadline=None)
# An atlas of four touches takes a second.
FEWER = settings(FEW, max_examples=3)
SEED = st.integers(0, 10**6)
DRAW = st.integers(0, 3)
SURFACE = st.sampled_from(["ball", "ellipsoid", "bottle_neck", "torus"])
SCALE = st.floats(-4.0, 4.0).map(lambda power: 10.0**power)
# Rounding, which the condition of the prior, 1e6 at most, may enlarge.
ROUNDING = 1e-6


def mirror_of(rng) -> np.ndarray:
    """(3, 3) reflection through a random plane, after a random rotation."""
    rotation = random_rotation(rng)
    return rotation @ (np.eye(3) - 2.0 * np.outer(rotation[0], rotation[0]))


def heights_differ_by(one, two, points, there, scale: float) -> float:
    """Largest difference of distances and deviations of two patches, over the radius."""
    distance = two.signed_distance(there) / scale - one.signed_distance(points)
    deviation = two.deviation(there) / scale - one.deviation(points)
    return float(np.abs([distance, deviation]).max() / one.radius)


@FEW
@given(SURFACE, DRAW, SEED, SCALE, st.booleans())
def test_motion_unit_and_reflection_leave_a_patch_the_same(surface, draw, seed, scale, mirror):
    scene, rng = scene_of(surface, draw), np.random.default_rng(seed)
    turn = mirror_of(rng) if mirror else random_rotation(rng)
    shift = 50.0 * scale * rng.normal(size=3)
    there = moved(scene.contours, turn, shift, scale)
    one = fit_of(scene).patch
    two = fit_patch(scale * turn @ scene.contact + shift, there, turn @ scene.normal).patch
    points = scale * scene.verifying @ turn.T + shift
    assert heights_differ_by(one, two, scene.verifying, points, scale) < ROUNDING
    assert two.curvatures.k1 * scale == pytest.approx(one.curvatures.k1, rel=1e-4, abs=1e-9)
    assert two.radius == pytest.approx(scale * one.radius, rel=ROUNDING)
    assert two.residual_rms == pytest.approx(scale * one.residual_rms, rel=ROUNDING)
    assert two.normal(points) == pytest.approx(one.normal(scene.verifying) @ turn.T, abs=ROUNDING)


@FEW
@given(SURFACE, DRAW, SEED)
def test_curves_and_their_points_in_any_order_give_the_same_patch(surface, draw, seed):
    """The order of the curves, and the end at which each begins. The frame stops within half a
    deviation of the mean, which another first curve may place differently."""
    scene, rng = scene_of(surface, draw), np.random.default_rng(seed)
    chosen = [scene.contours[i] for i in rng.permutation(len(scene.contours))]
    there = tuple(
        replace(c, points=c.points[::-1], ends=c.ends[::-1]) if rng.random() < 0.5 else c
        for c in chosen
    )
    one, two = fit_of(scene).patch, fit_of(scene, there).patch
    apart = np.abs(two.signed_distance(scene.verifying) - one.signed_distance(scene.verifying))
    assert (apart <= 0.5 * one.deviation(scene.verifying) + ROUNDING * one.radius).all()


def few_touches(seed: int) -> list[Touch]:
    """Four touches of a quadric, 10 apart, with curves of 8 to both sides."""
    height, rng = quadric_height(0.01, -0.02), np.random.default_rng(seed)
    touches = []
    for number, (x, y) in enumerate([(0.0, 0.0), (10.0, 0.0), (0.0, 10.0), (10.0, 10.0)]):
        place = np.array([x, y, height(x, y)])

        def around(u, v, x=x, y=y):
            return height(x + u, y + v) - height(x, y)

        curves = moved(
            contours_of(around, 8.0, noise=NOISE, seed=int(rng.integers(1e6)), points=17),
            np.eye(3),
            place,
        )
        touches.append(Touch(number, place, UP, curves, TouchStatus.TOUCHED, 48.0, 0.0))
    return touches


def learned(touches, tolerance: float) -> Atlas:
    atlas = Atlas(tolerance)
    for touch in touches:
        atlas.add(touch)
    atlas.validate()
    return atlas


def over_the_touches() -> np.ndarray:
    """(36, 3) points of the quadric between and about the four touches."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-4, 14, 6), np.linspace(-4, 14, 6)))
    return np.column_stack([x, y, quadric_height(0.01, -0.02)(x, y)])


@FEWER
@given(SEED, SCALE)
def test_shift_and_unit_leave_an_atlas_the_same(seed, scale):
    rng, touches, points = np.random.default_rng(seed), few_touches(seed), over_the_touches()
    shift = 50.0 * scale * rng.normal(size=3)
    one = learned(touches, 0.1)
    two = learned([moved_touch(t, np.eye(3), shift, scale) for t in touches], 0.1 * scale)
    here, there = one.blend(points), two.blend(scale * points + shift)
    assert len(one) == len(two) and (here.known == there.known).all() and here.known.mean() > 0.5
    for name in ("distance", "deviation"):
        apart = getattr(there, name) / scale - getattr(here, name)
        assert np.abs(apart[here.known]).max() < ROUNDING * 8.0


@FEWER
@given(SEED, st.booleans())
def test_turn_and_reflection_change_an_atlas_by_less_than_its_deviations(seed, mirror):
    """The bounding box of the samples turns differently, and with it the radius of the sextics and
    which of them meet where: by half a deviation in the median."""
    rng, touches, points = np.random.default_rng(seed), few_touches(seed), over_the_touches()
    turn = mirror_of(rng) if mirror else random_rotation(rng)
    here = learned(touches, 0.1).blend(points)
    turned = learned([moved_touch(t, turn, np.zeros(3), 1.0) for t in touches], 0.1)
    there = turned.blend(points @ turn.T)
    both = here.known & there.known
    assert both.mean() > 0.5 and (here.known == there.known).mean() > 0.8
    apart = np.abs(here.distance - there.distance)[both]
    assert np.median(apart / here.deviation[both]) < 0.5


@FEWER
@given(SEED, st.permutations(range(4)))
def test_touches_in_any_order_give_an_atlas_within_its_deviations(seed, order):
    """The same samples in other frames: half a deviation, where patches end at other places."""
    touches, points = few_touches(seed), over_the_touches()
    here = learned(touches, 0.1).blend(points)
    there = learned([touches[i] for i in order], 0.1).blend(points)
    both = here.known & there.known
    assert both.mean() > 0.5
    apart = np.abs(here.distance - there.distance)[both]
    assert np.median(apart / here.deviation[both]) < 0.5


@FEW
@given(SURFACE, DRAW, st.floats(-1e3, 1e3))
def test_where_a_plane_is_stated_does_not_matter(surface, draw, along):
    """Any of its points and either normal state the same plane."""
    scene = scene_of(surface, draw)
    there = []
    for contour in scene.contours:
        plane = contour.plane
        across = np.cross(plane.normal, [0.3, 0.5, 0.8])
        other = SamplingPlane(plane.point + along * across, -plane.normal)
        there.append(Contour(contour.points, other, contour.noise_std, contour.ends))
    one, two = fit_of(scene).patch, fit_of(scene, tuple(there)).patch
    assert heights_differ_by(one, two, scene.verifying, scene.verifying, 1.0) < ROUNDING
