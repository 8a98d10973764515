"""Crossings: contours of different touches measure one place, whatever the shape of the object."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.explored import entered, spread_touches
from tests.lawful_meshes import lawful_object
from tests.truths import scaled
from touchatlas.atlas.samples.crossings import Crossings
from touchatlas.atlas.samples.object_move import most_probable_move
from touchatlas.sim import make_object
from touchatlas.sim.study.explorations import shifted

COUNT = 30


def crossings(name, touches=None) -> Crossings:
    obj = make_object(name)
    given = spread_touches(obj, COUNT) if touches is None else touches
    return entered(given, obj.tolerance).evidence.crossings


def move_of(found: Crossings):
    return most_probable_move(found, list(range(COUNT)), 4.0)


@pytest.mark.parametrize(
    "name", ["sphere", "bottle", pytest.param("mouse", marks=pytest.mark.slow), "torus"]
)
def test_gaps_of_an_object_that_lies_still_are_noise(name):
    """Squares over their variances follow chi-square but once in ten thousand. Nine in ten normals
    are those of the object to 10 degrees, and places lie on it to three deviations of a sample: of
    contours that cross at a small angle less is known."""
    obj, found = make_object(name), crossings(name)
    squares = found.gaps**2 / found.variances
    assert len(squares) > 30
    low, high = chi2.ppf([5e-5, 1.0 - 5e-5], len(squares))
    assert low < squares.sum() < high
    value, gradient = obj.field.first_order(found.points)
    steep = np.linalg.norm(gradient, axis=1)
    assert np.mean(np.abs(value) < 3.0 * obj.noise_std * steep) > 0.9
    cosine = (gradient * found.normals).sum(axis=1) / steep
    assert np.mean(cosine > np.cos(np.radians(10.0))) > 0.9
    assert move_of(found).chance > 1e-4


def test_a_move_between_two_touches_is_found_with_its_size():
    """Of a third of the tolerance, in a direction that the normals of a ball all see: the normal
    equations tell its deviation."""
    obj, step = make_object("sphere"), np.array([0.02, -0.02, 0.02])
    touches = spread_touches(obj, COUNT)
    found = crossings(obj.name, [shifted(t, step) if t.number >= 12 else t for t in touches])
    move = move_of(found)
    across = (found.earlier < 12.0) & (found.later >= 12.0)
    scaled = found.normals[across] / np.sqrt(found.variances[across])[:, None]
    deviations = np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)))
    assert move.after == 11 and move.chance < 1e-12
    assert (np.abs(move.shift - step) < 4.0 * deviations).all()
    assert len(move.places) == across.sum()


def test_contours_of_two_faces_that_meet_at_their_edge_do_not_cross():
    """Of a cube all crossings lie on one face, with its normal, but for those of contours that
    hardly cross."""
    found = crossings("cube")
    assert len(found.gaps) > 30
    assert np.mean(np.abs(found.normals).max(axis=1) > np.cos(np.radians(10.0))) > 0.9
    assert (np.abs(found.gaps) < 5.0 * np.sqrt(found.variances)).all()


def test_few_samples_of_a_contour_leave_gaps_that_are_known_to_be_wide():
    """Of a bottle every fourth sample: cubics miss its shoulder by more than noise."""
    obj = make_object("bottle")

    def thinned(contour):
        return replace(contour, points=contour.points[::4])

    touches = [
        replace(touch, contours=tuple(map(thinned, touch.contours)))
        for touch in spread_touches(obj, COUNT)
    ]
    found = crossings(obj.name, touches)
    assert len(found.gaps) > 100
    assert (np.abs(found.gaps) < 5.0 * np.sqrt(found.variances)).all()


def test_one_gap_alone_tells_no_move():
    """Eleven crossings of few touches, of which one misses by a hundred deviations."""
    normals = np.tile(np.eye(3)[2], (11, 1))
    normals[0] = np.eye(3)[0]
    gaps = np.where(np.arange(11) == 0, 100.0, 0.5)
    later = np.repeat([1.0, 2.0, 3.0], [4, 4, 3])
    found = Crossings(later - 1.0, later, normals, normals, gaps, np.ones(11))
    assert most_probable_move(found, [0.0, 1.0, 2.0, 3.0], 4.0).chance > 0.1


def test_a_drift_is_no_single_move():
    obj, step = make_object("sphere"), np.array([0.0, 0.004, 0.003])
    touches = [shifted(t, t.number * step) for t in spread_touches(obj, COUNT)]
    move = move_of(crossings(obj.name, touches))
    assert move.after is None and move.shift == pytest.approx(step, abs=1e-3)


def test_a_few_false_gaps_tell_no_move():
    """Three of a hundred gaps are a hundred deviations wide, with normals of their own."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        normals = rng.normal(size=(100, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        later = rng.integers(1, COUNT, 100).astype(float)
        earlier = np.floor(rng.random(100) * later)
        gaps = rng.normal(size=100)
        gaps[:3] = 100.0
        found = Crossings(earlier, later, normals, normals, gaps, np.ones(100))
        assert move_of(found).chance > 1e-6


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lawful_object, "filleted"),
        # Its mesh alone takes ten seconds.
        pytest.param(make_object, "plate", marks=pytest.mark.slow),
    ],
)
def test_a_body_with_fillets_lies_still(make, name):
    """Where a fillet begins between two samples, gaps are larger than noise explains."""
    obj = make(name)
    found = entered(spread_touches(obj, COUNT), obj.tolerance).evidence.crossings
    assert len(found.gaps) > 30
    assert move_of(found).chance > 1e-4


def test_detail_between_samples_is_no_move():
    """Gaps are three times as wide as noise explains, at all touches alike: of a hundred scenes one
    is expected below a chance of 0.01, and eight are four deviations more."""
    rng, low = np.random.default_rng(3), 0
    for _ in range(100):
        normals = rng.normal(size=(80, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        later = rng.integers(1, COUNT, 80).astype(float)
        earlier = np.floor(rng.random(80) * later)
        found = Crossings(earlier, later, normals, normals, 3.0 * rng.normal(size=80), np.ones(80))
        low += move_of(found).chance < 0.01
    assert low < 8


def test_crossings_do_not_depend_on_the_unit():
    obj = make_object("sphere")
    touches = spread_touches(obj, 8)
    inches = [scaled(touch, 1.0 / 25.4) for touch in touches]
    one = entered(touches, 0.1).evidence.crossings
    other = entered(inches, 0.1 / 25.4).evidence.crossings
    assert len(one.gaps) > 5
    assert np.allclose(one.gaps, 25.4 * other.gaps, atol=1e-9)
    assert np.allclose(one.variances, 25.4**2 * other.variances)
    assert np.allclose(one.normals, other.normals)


def test_a_table_holds_all_crossings():
    found = crossings("sphere")
    again = Crossings.of_table(found.table)
    for name in ("earlier", "later", "points", "normals", "gaps", "variances"):
        assert np.array_equal(getattr(again, name), getattr(found, name))


@pytest.mark.parametrize(("last", "is_told"), [(1, False), (2, True)])
def test_one_touch_alone_tells_no_move(last, is_told):
    """Twelve crossings of each touch with the one before in three directions. Those of the first
    three agree, and the ``last`` ones are ten deviations off."""
    count, normals = 3 + last, np.tile(np.eye(3), (4, 1))
    pairs = [(k, later) for later in range(1, count) for k in range(min(later, 3))]
    off = [0.0 if later < 3 else 1.0 for _, later in pairs]
    numbers, every = (
        np.repeat(np.array(pairs, float), 12, axis=0),
        np.tile(normals, (len(pairs), 1)),
    )
    gaps = np.repeat(off, 12) * every[:, 0]
    found = Crossings(*numbers.T, every, every, gaps, np.full(len(gaps), 0.01))
    move = most_probable_move(found, [float(k) for k in range(count)], 4.0)
    assert (move.chance < 1e-6 and move.after == 2) == is_told
