"""Faults of probes: each does one thing, they compose, and a resume repeats them."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.atlas import TouchStatus
from touchatlas.patch import ContourEnd
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim import Probe, RunOptions, make_object
from touchatlas.sim.machine.fault_words import faults_of
from touchatlas.sim.machine.faults import with_faults
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.run.exploration import completed

BALL, NOISE, TOLERANCE = make_object("sphere"), 0.02, 0.5
TOP = np.array([0.0, 0.0, 33.0])


def probe(words: str, seed: int = 0, noise: float = NOISE):
    rng = np.random.default_rng(seed)
    return with_faults(Probe(BALL, noise, rng), words, TOLERANCE, lambda: Feet(BALL), rng)


def plan(number: int = 0) -> ProbePlan:
    up = TOP / 33.0
    planes = concurrent_planes(TOP, up, np.array([1.0, 0.0, 0.0]), 3)
    return ProbePlan(number, TOP, up, planes, 30.0, 0.5, 2.0, Reason.REFINE)


def points_of(touch) -> np.ndarray:
    return np.concatenate([contour.points for contour in touch.contours])


def off(touch) -> np.ndarray:
    """(n,) heights of samples over the ball."""
    return np.linalg.norm(points_of(touch), axis=1) - 33.0


def test_noise_is_so_many_times_the_stated():
    """361 heights; four standard errors of a deviation are 4 / sqrt(2 * 361) = 15 %."""
    touch = probe("noise=3")(plan())
    assert off(touch).std() == pytest.approx(3.0 * NOISE, rel=0.15)
    assert touch.contours[0].noise_std == NOISE


def test_a_tip_lies_outside_by_its_radius_with_its_contact_and_its_way():
    touch = probe("tip=2", noise=0.0)(plan())
    assert np.allclose(off(touch), 2.0, atol=1e-6)
    bare = probe("", noise=0.0)(plan())
    assert np.linalg.norm(touch.contact - bare.contact) == pytest.approx(2.0)
    assert touch.way[1] == pytest.approx(touch.contact, abs=1e-6)


def test_planes_are_turned_but_not_in_what_is_said():
    touch = probe("plane=5", noise=0.0)(plan())
    for contour, plane in zip(touch.contours, plan().planes, strict=True):
        assert (contour.plane.normal == plane.normal).all()
        beside = np.abs((contour.points - contour.points[60]) @ plane.normal).max()
        assert 0.0 < beside <= 30.0 * np.sin(np.radians(5.0))
    assert np.abs(off(touch)).max() < 1e-6


def test_a_way_around_an_object_that_moved_moves_with_it():
    """The probe goes where the planner knows a free way, whatever has moved."""
    gone = []

    def within(planned):
        gone.append(planned.way_from(np.zeros(3)))
        return Probe(BALL, 0.0, np.random.default_rng(0))(planned)

    corner = np.array([0.0, 50.0, 50.0])
    around = replace(plan(1), way=lambda start, goal, radius: np.stack([corner, goal]))
    rng = np.random.default_rng(0)
    with_faults(within, "moved=2:touch1", TOLERANCE, lambda: Feet(BALL), rng)(around)
    [(first, last)] = gone
    shift = around.begin() - last
    assert np.linalg.norm(shift) == pytest.approx(2.0 * TOLERANCE)
    assert first == pytest.approx(corner - shift)
    nowhere = replace(plan(1), way=lambda start, goal, radius: None)
    with_faults(within, "moved=2:touch1", TOLERANCE, lambda: Feet(BALL), rng)(nowhere)
    assert gone[1] is None


def test_an_object_moves_by_some_tolerances_before_a_touch():
    faulty = probe("moved=2:touch1", noise=0.0)
    assert np.abs(off(faulty(plan(0)))).max() < 1e-6
    moved = faulty(plan(1))
    points = points_of(moved)
    # The sphere through them: |p|^2 = 2 c p + r^2 - |c|^2.
    found = np.linalg.lstsq(np.c_[2 * points, np.ones(len(points))], (points**2).sum(axis=1))[0]
    assert np.linalg.norm(found[:3]) == pytest.approx(2.0 * TOLERANCE, abs=1e-6)


def test_drift_grows_with_every_touch():
    faulty = probe("drift=0.1", noise=0.0)
    first, tenth = (np.abs(off(faulty(plan(k)))).max() for k in (0, 9))
    assert 0.0 < first < 0.05 + 1e-9 and tenth > 5.0 * first


def test_curves_are_displaced_each_by_itself():
    clean, touch = probe("", noise=0.0)(plan()), probe("displaced=0.2", noise=0.0)(plan())
    ways = [a.points - b.points for a, b in zip(touch.contours, clean.contours, strict=True)]
    assert all(np.ptp(way, axis=0).max() < 1e-9 for way in ways)
    assert np.allclose([np.linalg.norm(way[0]) for way in ways], 0.2 * TOLERANCE)
    assert np.linalg.norm(ways[0][0] - ways[1][0]) > 1e-3


def test_a_share_of_the_points_is_far_off():
    """Of 363 points 5 % are 18 +- 4; a third of those lie farther out than five deviations."""
    far = np.abs(off(probe("outliers=0.05")(plan()))) > 5.0 * NOISE
    assert 4 < far.sum() < 34


def test_arms_end_early_as_if_contact_were_lost():
    touch = probe("lost=1")(plan())
    assert all(contour.ends == (ContourEnd.LOST_CONTACT,) * 2 for contour in touch.contours)
    assert touch.status is TouchStatus.TOUCHED and len(points_of(touch)) < 363


def test_faults_compose_and_go_on_after_a_resume():
    words = "noise=3,displaced=0.2,moved=1:touch1"
    once = probe(words)
    first, second = once(plan(0)), once(plan(1))
    again = probe(words)
    again(plan(0))
    held = again.state()
    later = probe(words)
    later.restore(held)
    assert np.array_equal(points_of(later(plan(1))), points_of(second))
    assert not np.array_equal(points_of(first), points_of(second))
    with pytest.raises(ValueError, match="state cannot be read"):
        later.restore("{}")


def test_words_that_name_no_fault_are_refused():
    assert faults_of("") == ()
    for words in ("noise", "noise=", "noise=-1", "wrong=2", "noise=3;tip=2", "noise=1e999"):
        with pytest.raises(ValueError, match="fault is .*names are noise, tip, plane"):
            RunOptions(fault=words)
    for words, said in (
        ("outliers=2", "outliers is 1 at most"),
        ("plane=1000", "plane is 30 at most"),
        ("noise=1e6", "noise is 1000 at most"),
        ("noise=3,tip=1,noise=2", "names noise twice"),
        ("noise=3,", "there are commas between several"),
        ("moved=5", "give the touch before which the object moves"),
        ("moved=5:touch0", "as moved=5:touch5"),
    ):
        with pytest.raises(ValueError, match=said):
            RunOptions(fault=words)


def test_planes_may_be_turned_as_far_as_contours_allow():
    assert probe("plane=30")(plan()).status is TouchStatus.TOUCHED


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("tip=1000", "fault is 'tip=1000'; tip is 114.3 at most, the diagonal of the object"),
        ("displaced=300", "displaced is 228.6 at most, the diagonal of the object in tolerances"),
        ("drift=300", "drift is 228.6 at most"),
        ("moved=300:touch1", "moved is 228.6 at most"),
    ],
)
def test_faults_are_as_large_as_the_object_at_most(words, said):
    """The ball of radius 33 has a diagonal of 114.3, and the tolerance is 0.5."""
    assert BALL.diagonal == pytest.approx(2.0 * 33.0 * 3.0**0.5, rel=1e-3)
    with pytest.raises(ValueError, match=said):
        completed(RunOptions(fault=words, tolerance=TOLERANCE), BALL)
    half = words.replace("000", "").replace("300", "150")
    completed(RunOptions(fault=half, tolerance=TOLERANCE), BALL)


@pytest.mark.parametrize("words", ["noise=1000", "tip=100"])
def test_a_fault_that_leaves_no_contours_is_named(words):
    with pytest.raises(ValueError, match=rf"fault is {words}, too much for touch 0 \(.*smaller"):
        probe(words, noise=0.1)(plan())
