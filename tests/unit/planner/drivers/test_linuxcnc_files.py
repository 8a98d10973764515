"""A program for LinuxCNC from plans, and its logs as touches. The real LinuxCNC runs such a program
in test_linuxcnc_live.py; here logs are written line by line as it writes them."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.unit.planner.drivers.linuxcnc_logs import log_of
from touchatlas.atlas import TouchStatus
from touchatlas.patch import ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.drivers.guarded import GuardOptions, lateness
from touchatlas.planner.drivers.linuxcnc_files import linuxcnc_program, log_name, star_of
from touchatlas.planner.drivers.linuxcnc_logs import touch_of_log
from touchatlas.planner.tracking.options import Tip, TriggerOptions

CENTRES, TIP = 21.0, Tip(radius=1.0, radius_std=0.002, noise_std=0.003)
OPTIONS, MOTION, PERIOD = TriggerOptions(points=4), GuardOptions(feed=5.0), 0.001


def plan_at(place, number=3, reach=12.0):
    """Three planes through a place of the ball of centres about 0."""
    place = np.array(place, float) / np.linalg.norm(place)
    across = np.cross(place, [0.1, 0.7, 0.3])
    across /= np.linalg.norm(across)
    other = np.cross(place, across)
    turns = np.pi * np.arange(3) / 3
    planes = [np.cos(a) * across + np.sin(a) * other for a in turns]
    planes = tuple(SamplingPlane(CENTRES * place, w) for w in planes)
    return ProbePlan(number, CENTRES * place, place, planes, reach, 1.0, np.pi, Reason.START)


def test_a_log_becomes_centres_on_the_ball_of_the_centres():
    """Digits of the log, 6, and the mean lateness, which is taken off."""
    plan = plan_at([1.0, 2.0, 3.0])
    bias, spread = lateness(MOTION.feed, PERIOD)
    touch = touch_of_log(
        log_of(plan, OPTIONS, CENTRES, late=bias), plan, TIP, OPTIONS, MOTION, PERIOD
    )
    assert touch.status is TouchStatus.TOUCHED
    assert (touch.tip_radius, touch.systematic_std, touch.number) == (1.0, 0.002, 3)
    for contour in touch.contours:
        assert len(contour.points) == 2 * OPTIONS.points + 1
        np.testing.assert_allclose(np.linalg.norm(contour.points, axis=1), 21.0, atol=2e-6)
        # The ways of the points of a contour are in its plane.
        off = (contour.points - touch.contact) @ contour.plane.normal
        np.testing.assert_allclose(off, 0.0, atol=2e-6)
        assert contour.noise_std == pytest.approx(np.hypot(0.003, spread))
    np.testing.assert_allclose(touch.way[1], touch.contact, atol=2e-6)


def test_an_arm_ends_at_its_first_point_that_met_nothing():
    """On a ball of 21 mm arms of 30 mm run off: the fourth point is 30 mm beside the contact."""
    plan = plan_at([0.0, 0.0, 1.0], reach=30.0)
    touch = touch_of_log(log_of(plan, OPTIONS, CENTRES), plan, TIP, OPTIONS, MOTION, PERIOD)
    for contour in touch.contours:
        assert len(contour.points) < 9
        assert contour.ends == (ContourEnd.TURNED_AWAY,) * 2


def test_no_contact_leaves_the_way_that_is_free():
    plan = plan_at([0.0, 0.0, 1.0])
    text = log_of(plan, OPTIONS, 5.0)
    assert len(text.splitlines()) == 3
    touch = touch_of_log(text, plan, TIP, OPTIONS, MOTION, PERIOD)
    assert touch.status is TouchStatus.NO_CONTACT
    star = star_of(plan, OPTIONS)
    np.testing.assert_allclose(touch.way, [star[0].start, star[0].target])


def test_a_log_of_a_program_that_was_stopped_gives_what_was_measured():
    plan = plan_at([0.0, 0.0, 1.0])
    touch = touch_of_log(
        log_of(plan, OPTIONS, CENTRES, lines=4 * 6), plan, TIP, OPTIONS, MOTION, PERIOD
    )
    counts = [len(contour.points) for contour in touch.contours]
    # The contact, and five of the points of the first plane; the others have the contact alone.
    assert counts == [1 + 5, 1, 1]
    with pytest.raises(ValueError, match="ends before the contact"):
        touch_of_log("", plan, TIP, OPTIONS, MOTION, PERIOD)


def test_the_program_makes_no_move_that_contact_would_not_stop():
    plans = [plan_at([0, 0, 1.0], 0), plan_at([0, 1.0, 1.0], 1)]
    text = linuxcnc_program(plans, OPTIONS, MOTION)
    codes = re.findall(r"\bG(\d+(?:\.\d)?)", text)
    assert {code for code in codes if code not in ("17", "21", "40", "49", "80", "90", "94")} == {
        "38.3",
        "38.5",
        "4",
    }
    assert text.count("PROBEOPEN") == 2 and text.rstrip().endswith("M2")
    assert [log_name(plan) for plan in plans] == ["touch-0000.txt", "touch-0001.txt"]
    # Each log is closed at its end, and where the program ends for a contact.
    assert text.count("(PROBECLOSE)") == 2 + 2
    points = [line for line in text.splitlines() if line.startswith("o<point> call")]
    assert len(points) == 2 * (1 + 3 * 2 * OPTIONS.points)
    assert "#<_touch_feed> = 300.0000" in text
    assert "G20" in linuxcnc_program(plans, OPTIONS, MOTION, unit="in")


def test_between_plans_the_tip_goes_by_their_safe_ways():
    """From above the contact of the one to above that of the other, where the ways do not repeat
    the goal."""
    first, plan = plan_at([0, 0, 1.0], 0), plan_at([0, 1.0, 1.0], 1)
    corner = np.array([0.0, 50.0, 60.0])
    asked = []

    def way(start, goal, radius):
        asked.append((start, goal, radius))
        return np.stack([corner, goal])

    text = linuxcnc_program([first, replace(plan, way=way)], OPTIONS, MOTION)
    (start, goal, radius), *others = asked
    assert not others and radius == 0.0
    np.testing.assert_allclose(start, star_of(first, OPTIONS)[0].start)
    np.testing.assert_allclose(goal, star_of(plan, OPTIONS)[0].start)
    between = text[text.index("(plan 1)") : text.index("(PROBEOPEN touch-0001")]
    assert re.findall(r"o<way> call (.*)", between) == ["[0.000000] [50.000000] [60.000000]"]


def test_wrong_logs_and_arguments_are_refused_in_a_sentence():
    plan, other = plan_at([0, 0, 1.0]), plan_at([0, 1.0, 1.0], 4)
    text = log_of(plan, OPTIONS, CENTRES)
    for log, words in (
        (text.replace("0.000000\n", "\n", 1), "line 1 of the log of plan 3 is"),
        (text + text, "more lines than plan 3 has moves"),
        ("hello\n", "nine numbers"),
    ):
        with pytest.raises(ValueError, match=words):
            touch_of_log(log, plan, TIP, OPTIONS, MOTION)
    with pytest.raises(ValueError, match="not that of plan 4"):
        touch_of_log(text, other, TIP, OPTIONS, MOTION)
    for arguments, words in (
        ({"plans": []}, "no plans"),
        ({"plans": [plan_at([0, 0, 1.0], reach=1.0)]}, "nearer than LinuxCNC probes"),
        ({"unit": "ft"}, "must be mm or in"),
        ({"name": "a/b"}, "letters, digits"),
    ):
        with pytest.raises(ValueError, match=words):
            linuxcnc_program(**{"plans": [plan], **arguments})
