"""Places: where the surface of a body is known, how well, and where it ends."""

from dataclasses import replace

import igl
import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.explored import learned_at_once, spread_touches
from tests.lawful import body_of, samples_of_touches, touched_mesh
from tests.lawful_meshes import HALF
from touchatlas.atlas import Atlas
from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.mesh.surface import body_surface
from touchatlas.atlas.samples.predictive_law import PredictiveLaw
from touchatlas.planner import Planner
from touchatlas.planner.known import Areas
from touchatlas.planner.places import Places, places_of
from touchatlas.planner.stop import Forecast, Stop, StopReason
from touchatlas.sim import make_object
from touchatlas.sim.study.bodies import cup

NOISE, TOLERANCE = 0.02, 0.1
# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE
# Area of the box, and of its part below x = 5 without the cut.
AREA = 8.0 * (HALF[0] * HALF[1] + HALF[1] * HALF[2] + HALF[2] * HALF[0])
CUT = 5.0
PART = 4.0 * HALF[1] * HALF[2] + 4.0 * (CUT + HALF[0]) * (HALF[1] + HALF[2])


def box(keep=None):
    columns = touched_mesh("box", 45, NOISE, 4)
    return body_of(samples_of_touches(columns, STD, None if keep is None else keep(columns[0])))


def places_of_body(body) -> Places:
    atlas = Atlas(TOLERANCE)
    atlas.known_body = KnownBody(body=body)
    return places_of(atlas)


@pytest.fixture(scope="module")
def whole():
    return places_of_body(box())


@pytest.fixture(scope="module")
def half_body():
    return box(lambda points: points[:, 0] < CUT)


@pytest.fixture(scope="module")
def half(half_body):
    return places_of_body(half_body)


def test_the_areas_of_a_closed_body_are_that_of_the_body(whole):
    """Planes are exact but for three deviations, and triangles cut no edge: 1e-3 of the area."""
    assert len(whole.rim) == 0
    found = whole.areas(TOLERANCE, PredictiveLaw(), np.zeros(0, bool))
    assert found.known == pytest.approx(AREA, rel=1e-3) and found.unknown == 0.0
    # The tolerance is more than twenty deviations: a t of seven degrees of freedom leaves 2e-7.
    assert found.within == pytest.approx(found.known, rel=1e-6)
    assert found.unscaled == found.within
    assert not len(whole.left(TOLERANCE, PredictiveLaw(), 0.2 * float(np.linalg.norm(HALF))))
    assert np.linalg.norm(whole.normals, axis=1) == pytest.approx(1.0, abs=1e-12)


def test_the_strip_beside_a_rim_is_known_as_far_as_samples_reach(half, half_body):
    """The rim is a rectangle about the body, 140 long, and its strip half a reach wide; zigzag of
    the cubes makes it longer, by less than the square root of two. What is known ends with the
    samples below x = 5 and a step and a half beyond, to a fourth of the strip."""
    some = np.ones(len(half.rim), bool)
    law = PredictiveLaw()
    found = half.areas(TOLERANCE, law, some)
    around, strip = 4.0 * (HALF[1] + HALF[2]), 0.5 * half_body.reach
    assert PART - 0.25 * strip * around < found.known < PART + (1.5 + 0.25 * strip) * around
    assert found.within == pytest.approx(found.known, rel=1e-6)
    whole = found.known + found.unknown - half.area.sum()
    assert 0.99 * strip * around < whole < np.sqrt(2.0) * strip * around
    # Rims that were tried do not count.
    without = half.areas(TOLERANCE, law, ~some)
    assert without.known == pytest.approx(half.area.sum(), rel=1e-12) and without.unknown == 0.0


def test_areas_follow_the_predicted_deviation(whole):
    """One deviation is 68.27 % of a normal error, which a t of many degrees of freedom is."""
    normal = PredictiveLaw(1e9, 1.0, 0.0)
    unsure = replace(whole, deviation=np.full(len(whole.area), TOLERANCE))
    found = unsure.areas(TOLERANCE, normal, np.zeros(0, bool))
    assert found.within / found.known == pytest.approx(0.6827, abs=1e-4)
    # Places that are listed are a tenth of the extent apart.
    extent = 2.0 * float(np.linalg.norm(HALF))
    left = unsure.left(TOLERANCE, normal, 0.1 * extent)
    apart = np.linalg.norm(left[:, None] - left, axis=2) + extent * np.eye(len(left))
    assert len(left) > 10 and apart.min() > 0.1 * extent


def test_the_size_of_a_rim_is_that_of_its_opening(half, half_body):
    """The rectangle at x = 5, to a cube and a step and a half at each end."""
    size = 2.0 * np.hypot(HALF[1], HALF[2])
    assert half.rim_size == pytest.approx(np.full(len(half.rim), size), abs=3.0 + size / 32)
    edge = half_body.extent / 32
    assert (half.rim[:, 0] > CUT - 2.0 * edge).all() and (half.rim[:, 0] < CUT + 1.5 + edge).all()


def test_an_atlas_without_a_touch_has_no_places():
    found = places_of(Atlas(0.1))
    assert len(found.points) == len(found.rim) == 0
    assert found.areas(0.1, PredictiveLaw(), np.zeros(0, bool)) == Areas(0.0, 0.0, 0.0, 0.0)


def test_places_measure_the_area_of_a_closed_ball():
    """Triangles with sides h of a seventh of the radius r have h^2 / 6 r^2 less than the ball."""
    found = places_of(learned_at_once(spread_touches(make_object("sphere"), 12), 0.1))
    assert len(found.rim) == 0
    assert found.area.sum() == pytest.approx(4.0 * np.pi * 33.0**2, rel=5e-3)


def test_an_opening_at_which_contact_was_lost_is_no_rim_to_touch():
    """Half a ball: contours that lost contact show the rim, fourteen touches nearly all of it."""
    atlas = learned_at_once(spread_touches(cup(0.5), 14, 0.01), 0.1)
    found = places_of(atlas)
    assert len(atlas.rims) and found.area.sum() == pytest.approx(2.0 * np.pi * 33.0**2, rel=0.1)
    assert len(found.rim) < 0.1 * 2.0 * np.pi * 33.0 / (atlas.body.extent / 32)


@pytest.fixture(scope="module")
def touches_of_blob():
    return spread_touches(make_object("blob"), 16, NOISE)


@pytest.fixture(scope="module")
def blob(touches_of_blob):
    """An atlas of all of them, which tests read alone."""
    return learned_at_once(touches_of_blob, TOLERANCE)


def test_where_cubes_are_too_coarse_for_a_closed_surface_is_no_opening(blob):
    """Corners of cubes of six tenths of the reach are too far from samples to be known."""
    edge = 0.6 * blob.body.reach
    open_ = igl.boundary_facets(body_surface(blob.body, edge).faces)[0]
    assert len(open_) and not len(places_of(blob, edge).rim)
    assert not len(places_of(blob).rim)


def test_what_is_known_in_a_hole_is_no_more_than_it_encloses(blob, monkeypatch):
    """Triangles of one side are taken away: strips beside the rim of a round hole, as wide as a
    fourth of it, know what is there, and no more than that; a bulge has more than the flat disc
    that its rim encloses."""
    whole = places_of(blob)

    def holed(body, cube):
        drawn = body_surface(body, cube)
        middles = drawn.vertices[drawn.faces].mean(axis=1)
        away = np.linalg.norm(middles - whole.points[0], axis=1)
        return replace(drawn, faces=drawn.faces[away > 0.1 * body.extent])

    monkeypatch.setattr("touchatlas.planner.places.body_surface", holed)
    monkeypatch.setattr(
        "touchatlas.planner.places._are_open", lambda body, rim, away, of: rim[:, 0] < np.inf
    )
    found = places_of(blob)
    hole = whole.area.sum() - found.area.sum()
    beside = found.rim_area.sum()
    assert np.isfinite(found.rim_deviation).all() and 0.5 * hole < beside < hole


def test_where_no_touch_was_is_an_opening(touches_of_blob):
    atlas = learned_at_once([t for t in touches_of_blob if t.contact[2] > 0.0], TOLERANCE)
    for edge in None, 0.2 * atlas.body.reach:
        found = places_of(atlas, edge)
        assert found.rim_size.max() > 0.3 * atlas.body.extent


def rims(sizes, slopes) -> Places:
    """Two rims of holes, with an unknown area of 2 and of 3 beside them."""
    up, none = np.array([[0.0, 0.0, 1.0]]), np.zeros((0, 3))
    rim, area = np.array([[5.0, 0.0, 0.0], [-5.0, 0.0, 0.0]]), np.array([[2.0], [3.0]])
    known = none, none, *np.zeros((3, 0))
    beside = area, np.full((2, 1), np.inf)
    return Places(*known, rim, np.tile(up, (2, 1)), *beside, np.array(sizes), np.array(slopes))


# A tenth of the distance to what is known is the deviation in the middle of a level hole, and 1.96
# of that are the tolerance.
LARGEST_CLOSED = 2.0 * TOLERANCE / (1.96 * 0.1)


def test_a_level_hole_is_closed_within_the_tolerance_up_to_a_size():
    found = rims([0.99 * LARGEST_CLOSED, 1.01 * LARGEST_CLOSED], [0.0, 0.0])
    assert found.stay_open(TOLERANCE, 1e3).tolist() == [False, True]


def test_a_hole_of_more_than_a_tenth_of_the_body_stays_open():
    assert rims([0.19, 0.21], [0.0, 0.0]).stay_open(TOLERANCE, 2.0).tolist() == [False, True]


def test_the_end_of_a_tube_stays_open_unless_it_is_as_narrow_as_the_tolerance():
    """It may end flat, as half a ball, or beyond: half a ball is as high as the radius, for which
    half of the size is taken."""
    found = rims([1.98 * TOLERANCE, 2.02 * TOLERANCE], [1.0, 1.0])
    assert found.stay_open(TOLERANCE, 1e3).tolist() == [False, True]


def test_holes_that_are_closed_within_the_tolerance_are_no_unknown_area():
    found = rims([1.01 * LARGEST_CLOSED, 0.99 * LARGEST_CLOSED], [0.0, 0.0])
    assert found.areas(TOLERANCE, PredictiveLaw(), found.stay_open(TOLERANCE, 1e3)).unknown == 2.0


def test_small_holes_count_in_the_forecast_until_the_planner_ended_as_known(monkeypatch, blob):
    """A surface of eight, and a hole of two; another one is closed within the tolerance."""
    sizes = [1.01 * LARGEST_CLOSED, 0.99 * LARGEST_CLOSED]
    up = np.array([[0.0, 0.0, 1.0]])
    sure = {"points": up, "normals": up, "deviation": np.array([1e-9]), "area": np.array([8.0])}
    sure["away"] = np.zeros(1)
    found = replace(rims(sizes, [0.0, 0.0]), **sure)
    monkeypatch.setattr("touchatlas.planner.planner.places_of", lambda atlas: found)
    planner = Planner(np.zeros(3), up[0])
    open_ = 8.0 / (8.0 + 2.0 * planner.options.levels.behind)
    assert planner.forecast(blob).predicted_coverage == pytest.approx(open_)
    for reason, share in (StopReason.STAGNATION, open_), (StopReason.KNOWN, 1.0):
        planner.stop = Stop(reason, Forecast(0.0, up), np.zeros((0, 3)))
        assert planner.forecast(blob).predicted_coverage == pytest.approx(share)


def test_what_samples_contradict_is_not_known():
    """A bump on a face of a cube that one contour met: the plane misses its samples by its height,
    and the places whose nearest sample is one of these are no surer; five deviations of noise."""
    cube, height = make_object("cube"), 5.0 * TOLERANCE
    touches = spread_touches(cube, 14)
    first, *others = touches[-1].contours
    points, k = first.points.copy(), len(first.points) // 3
    axis = np.abs(points[k]).argmax()
    points[k - 1 : k + 2, axis] += height * np.sign(points[k, axis])
    bump = replace(touches[-1], contours=(replace(first, points=points), *others))
    atlas = learned_at_once([*touches[:-1], bump], cube.tolerance)
    assert {face.kind for face in atlas.faces().faces} == {"plane"}
    found, samples = places_of(atlas), atlas.pool.points
    nearest = samples[cKDTree(samples).query(found.points)[1]]
    # Samples are moved into their plane, by less than the step between them.
    about = cKDTree(points[k - 1 : k + 2]).query(nearest)[0] < TOLERANCE
    assert about.any() and not about.all()
    assert (found.deviation[about] > height - 5.0 * cube.noise_std).all()
    assert np.median(found.deviation[~about]) < cube.noise_std
