"""Touches that an atlas refuses, in any unit, and those that it accepts."""

import re
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from tests.laws.ball_touches import NOISE, REACH, SOFT, UP, begun, contours, touch
from tests.truths import ball_height, graph_contours
from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.patch import Contour, SamplingPlane


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_contour_of_another_plane_or_frame_is_refused_in_any_unit(scale):
    one, two, _ = contours(scale=scale)
    for points, plane in (
        (one.points, two.plane),
        (one.points + scale * REACH * one.plane.normal, one.plane),
        (1e-3 * one.points, SamplingPlane(scale * np.array([0, 2.0, 0]), one.plane.normal)),
    ):
        with pytest.raises(ValueError, match="off their sampling plane.*same frame and unit"):
            Contour(points, plane, one.noise_std, one.ends)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_contour_as_far_off_its_plane_as_real_probes_are_is_accepted(scale):
    """Planes 20 degrees askew, arms no longer than their noise, and bad contacts far off."""
    one = contours(scale=scale)[0]
    askew = np.cos(np.deg2rad(20)) * one.plane.normal + np.sin(np.deg2rad(20)) * np.eye(3)[0]
    Contour(one.points, SamplingPlane(np.zeros(3), askew), 0.0, one.ends)
    noisy = scale * NOISE * np.random.default_rng(1).normal(size=(7, 3))
    Contour(noisy, one.plane, scale * NOISE, one.ends)
    bad = one.points.copy()
    bad[:4] += scale * 5.0
    Contour(bad, one.plane, 0.0, one.ends)
    Contour(one.points[:1] + [1e3, 0, 0], one.plane, scale * NOISE, one.ends)


def test_contours_that_miss_the_contact_are_refused():
    """Half an arm is a quarter of a contour; far less, and deviations of the noise, pass."""
    for contact in ([100.0, 0, 0], [0, 0, 0.6 * REACH]):
        with pytest.raises(ValueError, match="away from the contact"):
            touch(contours(), contact)
    touch(contours(), [0, 0, 0.4 * REACH])
    still = NOISE * np.random.default_rng(2).normal(size=(3, 7, 3))
    short = tuple(Contour(p, c.plane, NOISE, SOFT) for p, c in zip(still, contours(), strict=True))
    touch(short, [5 * NOISE, 0, 0])


def test_a_touch_is_learned_once():
    """Twice it would seem to halve the variance. Of equal numbers, too, and if one contour is."""
    atlas, first = Atlas(0.1), touch(contours())
    assert not atlas.add(first).refused
    before = atlas.blend(np.zeros((1, 3))).deviation[0]
    fresh = graph_contours(ball_height, REACH, 13, NOISE, np.random.default_rng(5))
    for again in (first, touch(contours()), touch((*fresh[:2], contours()[2]))):
        assert "learned before" in atlas.add(again).refused
    assert (atlas.point_count, atlas.blend(np.zeros((1, 3))).deviation[0]) == (39, before)
    assert not atlas.add(touch(fresh)).refused
    assert atlas.point_count == 78
    assert atlas.blend(np.zeros((1, 3))).deviation[0] < before
    atlas.validate()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_way_that_the_probe_did_not_come_is_refused(scale):
    """And said what is wrong with it. The touch came from above."""
    up, along = scale * np.array(UP), scale * np.array([1.0, 0.0, 0.0])
    nothing, come = np.zeros(3), contours(scale=scale)
    missed = {"status": TouchStatus.NO_CONTACT, "tracked_length": 0.0}
    for first, last, words in (
        (up, up, "has no length"),
        (1e304 * up, -1e304 * up, "too large"),
        (10 * along, nothing, "does not run against"),
        (nothing, 10 * up, "does not run against"),
        (10 * up + 3 * along, 3 * along, f"passes {3 * scale:.4g} beside the contact"),
        (10 * up, -3 * up, f"ends {3 * scale:.4g} from the contact"),
        (10 * up, 5 * up, f"ends {5 * scale:.4g} from the contact"),
        (1e4 * up, 1e3 * up, f"ends {1e3 * scale:.4g} from the contact"),
        (-up, -10 * up, f"ends {10 * scale:.4g} from the contact"),
    ):
        with pytest.raises(ValueError, match=f"touch 0 .*{re.escape(words)}.*leave the way out"):
            touch(come, way=np.stack([first, last]))
    for first, last in ((20 * up, 10 * up), (-10 * up, -20 * up)):
        with pytest.raises(ValueError, match="does not pass the reference point"):
            touch((), way=np.stack([first, last]), **missed)
    with pytest.raises(ValueError, match="was not gone"):
        never = missed | {"status": TouchStatus.UNREACHABLE}
        touch((), way=np.stack([up, -up]), **never)
    for wrong in (10 * up, np.stack([np.nan * up, nothing])):
        with pytest.raises(ValueError, match="way"):
            touch(come, way=wrong)
    # Nine degrees askew, and a tenth of its length beside the contact.
    touch(come, way=np.stack([10 * up + 1.5 * along, nothing]))
    touch(come, way=np.stack([10 * up + along, along]))
    touch((), way=np.stack([10 * up, -10 * up]), **missed)


def test_shuffled_contours_are_refused_and_jumps_back_are_not():
    rng = np.random.default_rng(0)
    one = contours()[0]
    for order in (rng.permutation(len(one.points)) for _ in range(20)):
        with pytest.raises(ValueError, match="contour 0 of touch 0 has its points in no order"):
            touch((replace(one, points=one.points[order]), *contours()[1:]))
    # Tracked from the contact to one end, then from the contact to the other.
    half = len(one.points) // 2
    twice = np.concatenate([one.points[half:], one.points[:half][::-1]])
    touch((replace(one, points=twice), *contours()[1:]))


def test_bad_contacts_are_named_and_not_called_disorder():
    one = contours()[0]
    points = one.points.copy()
    points[[2, 9], 0] += 60.0
    with pytest.raises(ValueError, match=r"contour 0 of touch 0 has 2 of 13 .* points 3, 10\)"):
        touch((replace(one, points=points), *contours()[1:]))


@pytest.mark.parametrize("seed", [21, 80, 612])
def test_a_bad_contact_that_turns_the_normal_is_not_the_fault_of_the_approach(seed):
    """Four of eighteen points are bad: in these draws the quadric stands upright."""
    rng = np.random.default_rng(seed)
    three = []
    for contour in graph_contours(ball_height, 1.5, 6, 0.002, rng):
        points = contour.points.copy()
        if len(three) < 2:
            points[rng.integers(6, size=2)] += 0.5 * rng.normal(size=(2, 3))
        three.append(Contour(points, contour.plane, 0.002, SOFT))
    refused = Atlas(0.1).add(touch(tuple(three))).refused
    assert "bad contact" in refused or "failed contacts" in refused


def test_a_touch_of_one_contour_is_told_of_scans():
    refused = Atlas(0.1).add(touch(contours()[:1])).refused
    assert (
        "contours of 5 points or more: 1;" in refused and "a Scan takes a single curve" in refused
    )


@pytest.mark.parametrize("factor", [1e-3, 1 / 25.4, 0.1, 1 / 2.54, 2.54, 10.0, 25.4, 1e3])
def test_a_touch_in_another_unit_is_refused(factor):
    known = begun()
    atlas, again = deepcopy(known.atlas), known.touches[-1]
    scaled = replace(
        again,
        contact=factor * again.contact,
        way=factor * again.way,
        contours=tuple(
            replace(
                c,
                points=factor * c.points,
                plane=SamplingPlane(factor * c.plane.point, c.plane.normal),
                noise_std=factor * c.noise_std,
            )
            for c in again.contours
        ),
    )
    with pytest.raises(ValueError, match="give all in the same unit"):
        atlas.add(scaled)
    assert len(atlas) == len(known.atlas) and atlas.point_count == known.atlas.point_count
