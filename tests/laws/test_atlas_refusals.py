"""What a caller gets wrong: one clear sentence, and an atlas that is as it was before."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from tests.laws.ball_touches import SOFT, UP, begun, contours, touch
from tests.sharp import explored_sharp
from tests.truths import BALL_RADIUS
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
from touchatlas.patch import FitOptions


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


@pytest.mark.parametrize("name", ["noise_std", "normals", "approach"])
@pytest.mark.parametrize("wrong", [10**400, [[1, 2], [3]], np.datetime64("2020-01-01")])
def test_columns_of_a_scan_are_real_numbers(name, wrong):
    arguments = {"noise_std": 0.1} | {name: wrong}
    with pytest.raises(ValueError, match=f"{name} is .*real numbers"):
        Scan([[0.0, 0.0, 1.0]], **arguments)


def test_curves_of_a_scan_are_whole_numbers_and_directions_may_be_long():
    with pytest.raises(ValueError, match="give one whole number for each"):
        Scan([[0.0, 0.0, 1.0]], 0.1, curves=[[1, 2], [3]])
    far = Scan([[0.0, 0.0, 1.0]], 0.1, normals=[0.0, 0.0, 1e200])
    assert far.normals.tolist() == [[0.0, 0.0, 1.0]]


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


def test_untouched_is_a_value_not_an_error():
    atlas = Atlas(0.1)
    nothing = Touch(0, np.zeros(3), np.array([0, 0, 1.0]), (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    change = atlas.add(nothing)
    assert change.refused and len(atlas) == 0
    assert not atlas.blend(np.zeros((1, 3))).known.any()
