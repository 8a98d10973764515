"""LinuxCNC's simulated machine touches a ball and a box: live, and by a program that we write."""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest

from tests.unit.planner.drivers.linuxcnc_machine import missing, run_machine
from touchatlas.patch import SamplingPlane
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.drivers.guarded import GuardOptions
from touchatlas.planner.drivers.linuxcnc_files import linuxcnc_program, log_name
from touchatlas.planner.drivers.linuxcnc_live import LinuxCnc
from touchatlas.planner.drivers.linuxcnc_logs import touch_of_log
from touchatlas.planner.tracking.options import Tip, TriggerOptions

FEED, PERIOD, CENTRE, RADIUS = 5.0, 0.001, np.array([30.0, 40.0, -30.0]), 20.0
needs_machine = pytest.mark.skipif(bool(missing()), reason=missing() or "LinuxCNC is here")


def test_without_linuxcnc_the_driver_says_what_it_needs():
    """This Python has no module of LinuxCNC, unless it is the system's."""
    try:
        import linuxcnc  # noqa: F401
    except ImportError:
        with pytest.raises(ValueError, match="linuxcnc-uspace"):
            LinuxCnc()
    with pytest.raises(ValueError, match="must be mm or in"):
        LinuxCnc(unit="ell")


@pytest.fixture
def folder():
    """A folder that an ordinary user may enter, unlike those of pytest."""
    made = Path(tempfile.mkdtemp(prefix="touchatlas-"))
    made.chmod(0o755)
    yield made / "machine"
    shutil.rmtree(made, ignore_errors=True)


_LIVE = """
from touchatlas.planner.drivers.guarded import GuardedTrigger, GuardOptions, MachineFault
from touchatlas.planner.drivers.linuxcnc_live import LinuxCnc

machine = LinuxCnc()
trigger = GuardedTrigger(machine, GuardOptions(feed=5.0, travel=40.0))
found["period"] = machine.period
rng = np.random.default_rng(0)
ball, hits = np.array([30.0, 40.0, -30.0]), []
trigger.move([ball + [0, 0, 24.0]])
for _ in range(20):
    u = rng.normal(size=3)
    u[2] = abs(u[2]) + 0.3
    u /= np.linalg.norm(u)
    corner = ball + 30.0 * (u + [0, 0, 1]) / np.linalg.norm(u + [0, 0, 1])
    arrived = trigger.move([corner, ball + 23.0 * u])
    hits.append([arrived, u.tolist(), trigger.probe(ball + 17.0 * u).tolist()])
    trigger.move([ball + 23.0 * u, corner, ball + [0, 0, 24.0]])
found["ball"] = hits
box, half, hits = np.array([-40.0, 0.0, -40.0]), np.array([15.0, 10.0, 10.0]), []
above = box + [0, 0, 30.0]
found["to the box"] = trigger.move([ball + [0, 0, 40.0], above + [0, 0, 20.0], above])
for k in range(10):
    axis, sign = (2, 1.0) if k < 4 else (0, 1.0) if k < 7 else (1, -1.0)
    u = sign * np.eye(3)[axis]
    place = box + (half + 1.0) * u + rng.uniform(-8, 8, 3) * (1 - np.abs(u))
    trigger.move([above + 20.0 * u, place + 10.0 * u, place + 3.0 * u])
    hits.append([axis, sign, trigger.probe(place - 3.0 * u).tolist()])
    trigger.move([place + 10.0 * u, above + 20.0 * u])
found["box"] = hits
trigger.move([above])
found["miss"] = trigger.probe(above + [50.0, 0, 0])
trigger.move([above, ball + [0, 0, 40.0], ball + [-40.0, 0, 40.0], ball + [-40.0, 0, 0]])
found["through"] = trigger.move([ball + [40.0, 0, 0]])
found["stopped"] = machine.position().tolist()
found["back"] = trigger.move([ball + [-40.0, 0, 0]])
found["beyond"] = trigger.move([[0, 0, 150.0]])
try:
    machine.toward(np.array([0, 0, 150.0]), 5.0)
except MachineFault as error:
    found["limit"] = str(error)
found["slowest"] = slowest()
"""


@needs_machine
@pytest.mark.slow
def test_points_on_a_ball_and_a_box_are_those_of_the_body(folder):
    """A point is late by what the tip goes between two looks of the component, and between two of
    the controller; half a period of the controller is taken off."""
    found = run_machine(folder, _LIVE)
    assert found["period"] == PERIOD
    late = FEED * (found["slowest"] + PERIOD)
    early = 0.5 * FEED * PERIOD + 1e-3
    for arrived, u, place in found["ball"]:
        assert arrived
        error = np.linalg.norm(np.array(place) - CENTRE) - RADIUS
        assert -late <= error <= early
        np.testing.assert_allclose(
            np.cross(np.array(place) - CENTRE, u), 0.0, atol=RADIUS * 1e-4 + 0.01
        )
    for axis, sign, place in found["box"]:
        face = [-40.0, 0.0, -40.0][axis] + sign * ([15.0, 10.0, 10.0][axis] + 1.0)
        assert -late <= sign * (place[axis] - face) <= early
    assert found["to the box"] and found["miss"] is None
    # A way through the ball ends at it, and the tip goes back.
    assert not found["through"] and found["back"] and not found["beyond"]
    np.testing.assert_allclose(found["stopped"], CENTRE - [40.0, 0, 0], atol=1e-3)
    assert "limit" in found["limit"]


@needs_machine
@pytest.mark.slow
def test_a_program_that_we_write_runs_and_its_logs_are_touches(folder):
    """Two plans on the ball; the second's arms run off it."""
    tip, options = Tip(radius=1.0, noise_std=0.002), TriggerOptions(points=2, clearance=5.0)
    motion, plans = GuardOptions(feed=FEED, travel=40.0), []
    for number, reach in ((0, 8.0), (1, 22.0)):
        planes = tuple(SamplingPlane(CENTRE, w) for w in np.eye(3)[:2])
        top = CENTRE + [0, 0, RADIUS]
        plans.append(
            ProbePlan(number, top, np.array([0, 0, 1.0]), planes, reach, 0.4, np.pi, Reason.START)
        )
    program = linuxcnc_program(plans, options, motion)
    steps = 'run_program("p.ngc", 240)\nfound["slowest"] = slowest()\n'
    found = run_machine(folder, steps, [("p.ngc", program)])
    late = FEED * (found["slowest"] + PERIOD)
    for plan in plans:
        text = (folder / log_name(plan)).read_text()
        touch = touch_of_log(text, plan, tip, options, motion, PERIOD)
        for contour in touch.contours:
            error = np.linalg.norm(contour.points - CENTRE, axis=1) - RADIUS
            assert (-late <= error).all() and (error <= 0.5 * FEED * PERIOD + 1e-3).all()
    assert [len(contour.points) for contour in touch.contours] == [3, 3]
