"""What a caller gets wrong: one clear sentence, and an atlas that is as it was before."""

import re
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp
from tests.truths import BALL_RADIUS, ball_height, graph_contours
from touchatlas.atlas import (
    Atlas,
    AtlasOptions,
    Levels,
    Scan,
    Touch,
    TouchStatus,
    extract_surface,
    load_atlas,
    save_atlas,
)
from touchatlas.atlas.learn import learned_before
from touchatlas.patch import Contour, ContourEnd, FitOptions, SamplingPlane

UP, REACH, NOISE = [0.0, 0.0, 1.0], 10.0, 0.02
SOFT = (ContourEnd.LENGTH_REACHED,) * 2


def contours(noise=NOISE, scale=1.0):
    """Three through the top of the ball, at any scale."""
    found = graph_contours(ball_height, REACH, 13, noise, np.random.default_rng(0))
    return tuple(Contour(scale * c.points, c.plane, scale * c.noise_std, c.ends) for c in found)


def touch(contours, contact=(0.0, 0.0, 0.0), **changes):
    values = {"status": TouchStatus.TOUCHED, "tracked_length": 60.0, "travel_length": 0.0}
    values |= changes
    return Touch(0, contact, UP, contours, **values)


@lru_cache
def begun():
    return explored("sphere")


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


def with_contour(**changes):
    return replace(contours()[0], **changes)


def with_touch(**changes):
    return replace(touch(contours()), **changes)


def drawn(edge):
    return extract_surface(begun().atlas, edge)


def blend(points):
    return begun().atlas.blend(points)


def values(name, *some):
    return [{name: value} for value in some]


NOT_TOUCHED = (TouchStatus.NO_CONTACT, TouchStatus.UNREACHABLE)
# What is made, words of the refusal, and wrong arguments.
WRONG = [
    (with_contour, "real numbers", values("points", [["a", "b", "c"]], np.ones((5, 3)) * 1j)),
    (with_contour, "rows of equal length", values("points", [[1, 2, 3], [1, 2]])),
    (with_contour, "NaN", values("points", np.full((5, 3), np.nan))),
    (with_contour, r"shape \(5, 2\)", values("points", np.ones((5, 2)))),
    (with_contour, "empty", values("points", np.ones((0, 3)))),
    (with_contour, "SamplingPlane", values("plane", None)),
    (
        with_contour,
        r"noise_std is (None|1|-1|\[)",
        values("noise_std", None, "1", -1.0, np.ones(2)),
    ),
    (with_contour, "pair of ContourEnd", values("ends", ("a", "b"), SOFT[:1])),
    (with_touch, "tuple of Contour", values("contours", None, (np.zeros((5, 3)),))),
    (with_touch, "TOUCHED, but no contours; give those that were tracked", values("contours", ())),
    (with_touch, "TouchStatus", values("status", "touched")),
    (with_touch, "(NO_CONTACT|UNREACHABLE), but 3 contours", values("status", *NOT_TOUCHED)),
    (with_touch, "tracked_length is nan", values("tracked_length", np.nan)),
    (with_touch, "travel_length is -1", values("travel_length", -1.0)),
    (with_touch, "unit", values("approach", [0, 0, 2.0])),
    (with_touch, "shape", values("contact", [0, 0])),
    (with_touch, "number is .*that of a ProbePlan", values("number", "x", -1, 1.5, True, None)),
    (drawn, "edge is .*samples span", values("edge", 0, -1.0, np.nan, np.inf, "x", 1e3)),
    (blend, "points", values("points", [1, 2, 3], [[1, 2]], [[np.nan] * 3], "abc", [], None)),
    (Atlas, "tolerance is", values("tolerance", "x", None, [1.0], True, 0.0, -1.0)),
    (Atlas, "tolerance is", values("tolerance", np.nan, np.inf, 1e-300, 1e300)),
    (lambda options: Atlas(0.1, options), "must be AtlasOptions", values("options", FitOptions())),
    (AtlasOptions, "must be", values("bias", "x", None, np.nan, 1e300)),
    (AtlasOptions, "must be", values("facets", 0.0, None)),
    (AtlasOptions, "must be", values("levels", {"sure": 4.0})),
    (AtlasOptions, "tolerances|scales", [*values("facets", -1.0, np.nan), {"bias": -1.0}]),
    (FitOptions, "must be", values("degree", 4.0, None, -1, 0, 1, 2.5, 7, 50)),
    (FitOptions, "must be", values("core", "x", None, 0.0, -1.0, 2.0, np.nan)),
    (FitOptions, "must be", [{"height_only": "no"}, {"adaptive": 1}]),
    (Levels, "level sure is .* must be a number > 0", values("sure", 0.0, None)),
    *(
        (Levels, f"level {name} is .* must be a number > 0", values(name, wrong))
        for name, wrong in (
            ("same_side", 1.6),
            ("believed", 1.0),
            ("vague", 0.0),
            ("alpha", np.nan),
        )
    ),
]


@pytest.mark.parametrize(("make", "words", "wrong"), WRONG)
def test_what_cannot_be_is_refused_in_a_sentence(make, words, wrong):
    for arguments in wrong:
        with pytest.raises(ValueError, match=words):
            make(**arguments)


def test_what_is_no_touch_changes_nothing():
    atlas = Atlas(0.1)
    with pytest.raises(ValueError, match="give a Touch"):
        atlas.add(contours())
    assert atlas.touches == len(atlas) == 0


def test_surface_of_nothing_is_refused():
    with pytest.raises(ValueError, match="no surface; add"):
        extract_surface(Atlas(0.1))
    with pytest.raises(ValueError, match="got NoneType; a surface is drawn of an Atlas"):
        extract_surface(None)


def test_samples_without_noise_need_a_bias():
    """Otherwise each would be surer than any surface could be."""
    exact = touch(contours(noise=0.0))
    atlas = Atlas(0.1, AtlasOptions(bias=0.0))
    with pytest.raises(ValueError, match="noise of 0, and AtlasOptions.bias=0. bears no"):
        atlas.add(exact)
    points = exact.contours[0].points
    with pytest.raises(ValueError, match="the scan states a noise of 0"):
        atlas.add(Scan(points, 0.0, normals=np.tile(UP, (len(points), 1))))
    assert atlas.touches == len(atlas) == 0
    assert not Atlas(0.1).add(exact).refused
    assert not atlas.add(touch(contours())).refused


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


BODIES = {"sphere": lambda: explored("sphere"), "block": lambda: explored_sharp("block")}


@pytest.mark.parametrize("name", ["sphere", pytest.param("block", marks=pytest.mark.slow)])
def test_no_touch_is_learned_again_saved_or_not(name, tmp_path):
    """Samples are found where they were touched."""
    atlas, touches = BODIES[name]().atlas, BODIES[name]().touches
    count = atlas.point_count
    known = [t for t in touches if learned_before(atlas.pool, t.contours)]
    assert len(known) > 4
    save_atlas(tmp_path / "atlas.npz", atlas)
    for one in (atlas, load_atlas(tmp_path / "atlas.npz")):
        assert all("learned before" in one.add(t).refused for t in known)
        assert one.point_count == count


def test_an_edge_that_would_fill_the_memory_is_refused_and_what_is_advised_is_not():
    """A triangle for each 0.43 squares of the edge: 16 GB, at 100 bytes each, are 0.02 here."""
    for edge in (1e-2, 1e-9, 1e-300):
        with pytest.raises(ValueError, match="16 GB"):
            extract_surface(explored("sphere").atlas, edge)
    area = 4.0 * np.pi * BALL_RADIUS**2
    faces = len(extract_surface(explored("sphere").atlas, 2.0).faces)
    assert faces == pytest.approx(area / (0.25 * np.sqrt(3.0) * 2.0**2), rel=0.5)


@pytest.mark.slow
def test_edges_as_long_as_patches_make_few_triangles_or_none():
    for body in BODIES.values():
        atlas = body().atlas
        for edge in (30.0, 40.0):
            assert len(extract_surface(atlas, edge).faces) < 100


EXTREMES = {
    "as fine as rounding": (1e-12, {}),
    "as fine as can be": (1e-50, {}),
    "a third of the ball": (10.0, {}),
    "larger than the ball": (1e3, {}),
    "as large as can be": (1e50, {}),
    "no lack of fit accepted": (0.1, {"bias": 0.0}),
    "much lack of fit accepted": (0.1, {"bias": 2.0}),
    "coarse triangles": (0.1, {"facets": 1e3}),
}


@pytest.mark.parametrize("kind", EXTREMES)
def test_what_is_accepted_keeps_an_atlas_sound(kind):
    """Four touches of the ball, and the end. The triangles are not finer than an edge that is
    given."""
    tolerance, options = EXTREMES[kind]
    atlas = Atlas(tolerance, AtlasOptions(**options))
    for one in begun().touches[:4]:
        atlas.add(one)
    atlas.validate()
    atlas.finish()
    atlas.validate()
    assert np.isfinite(extract_surface(atlas, 5.0).vertices).all()


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


def test_untouched_is_a_value_not_an_error():
    atlas = Atlas(0.1)
    nothing = Touch(0, np.zeros(3), np.array([0, 0, 1.0]), (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    change = atlas.add(nothing)
    assert change.refused and len(atlas) == 0
    assert not atlas.blend(np.zeros((1, 3))).known.any()


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
