"""grbl as a trigger probe: a firmware of our own on a socket that does what grbl's source does."""

import os
import pty
import tty

import numpy as np
import pytest

from tests.unit.planner.drivers.fake_grbl import FakeGrbl
from touchatlas.planner.drivers.grbl import Grbl
from touchatlas.planner.drivers.guarded import (
    GuardedTrigger,
    GuardOptions,
    MachineFault,
    OutOfReach,
    late,
    lateness,
)
from touchatlas.planner.drivers.lines import open_lines
from touchatlas.planner.tracking.options import Tip

# A ball of 20 mm and a tip of 1 mm, in machine coordinates.
CENTRE, CONTACT = np.array([-150.0, -150.0, -60.0]), 21.0
# What a report in millimetres rounds off.
ROUNDING = 0.5e-3


def ball(place):
    return float(np.linalg.norm(place - CENTRE)) - CONTACT


@pytest.fixture
def machine():
    """A grbl with a trigger probe; the arguments are those of the fake and of the driver."""
    made = []

    def make(driver=None, box=None, options=GuardOptions(), **fake):
        firmware = FakeGrbl(fake.pop("gap", ball), **fake)
        grbl = Grbl.connect(f"tcp://127.0.0.1:{firmware.port}", patience=1.0, **(driver or {}))
        made.append(grbl)
        return firmware, GuardedTrigger(grbl, options, box)

    yield make
    for grbl in made:
        grbl.close()


def directions(count):
    """Upper half of the unit sphere, (count, 3)."""
    rng = np.random.default_rng(1)
    found = rng.normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2])
    return found / np.linalg.norm(found, axis=1)[:, None]


@pytest.mark.parametrize(
    "name, settings, driver, offset",
    [
        ("millimetres", {}, {}, (0.0, 0.0, 0.0)),
        ("reports in inches", {13: 1}, {}, (-40.0, -30.0, -20.0)),
        ("plans in inches", {}, {"unit": "in", "overtravel": 0.1}, (10.0, 0.0, -50.0)),
    ],
)
def test_centres_are_those_of_the_contacts_in_work_coordinates(
    machine, name, settings, driver, offset
):
    """Whatever units grbl reports in, and wherever the work system is."""
    unit = 25.4 if driver else 1.0
    options = GuardOptions().in_unit(1.0 / unit)
    firmware, trigger = machine(driver, options=options, settings=settings, offset=offset)
    centre = (CENTRE - offset) / unit
    for u in directions(6):
        assert trigger.move(
            [centre + 30.0 / unit * np.array([0, 0, 1.0]), centre + 30.0 / unit * u]
        )
        found = trigger.probe(centre + 15.0 / unit * u)
        # Along the normal of a ball all of the rounding of three coordinates may count.
        reported = 0.00005 * 25.4 if settings else ROUNDING
        assert np.linalg.norm(found - centre) * unit == pytest.approx(
            CONTACT, abs=2 * reported + 1e-4
        )
        assert trigger.move([centre + 30.0 / unit * u])
    assert firmware.crashes == 0
    assert not any(line.startswith(("G0", "G1")) for line in firmware.lines)


def test_a_probe_that_meets_nothing_gives_none_and_no_old_place(machine):
    """After a hit the next miss is reported with a place as well."""
    _, trigger = machine()
    above = CENTRE + [0.0, 0.0, 30.0]
    assert trigger.move([above])
    assert trigger.probe(CENTRE) is not None
    assert trigger.move([above, above + [40.0, 0.0, 0.0]])
    assert trigger.probe(CENTRE + [40.0, 0.0, 0.0]) is None


def test_a_way_that_meets_the_body_stops_there_and_says_so(machine):
    """A plain G1 on the same way drives through the ball."""
    firmware, trigger = machine()
    left, right = CENTRE - [40.0, 0, 0], CENTRE + [40.0, 0, 0]
    assert trigger.move([left])
    assert not trigger.move([right])
    # It is back where it began.
    np.testing.assert_allclose(firmware.at, left, atol=1e-9)
    assert not trigger.move([left + [0, 0, 30.0], left, right])
    np.testing.assert_allclose(firmware.at, left, atol=1e-9)
    # From contact, on into the body is no way out; back is.
    assert trigger.probe(CENTRE) is not None
    before = firmware.at
    assert not trigger.move([right])
    np.testing.assert_array_equal(firmware.at, before)
    assert trigger.move([left])
    assert firmware.crashes == 0
    firmware._answer("G21G1X-110Y-150Z-60F1000")
    assert firmware.crashes == 1


def test_limits_hold_before_anything_moves(machine):
    firmware, trigger = machine(box=[[-200, -200, -100], [-20, -20, -1]])
    assert not trigger.move([CENTRE + [0, 0, 30.0], CENTRE + [0, 0, 60.0]])
    with pytest.raises(OutOfReach, match="beyond the limits"):
        trigger.probe([-10.0, -100.0, -50.0])
    assert not any("G38" in line for line in firmware.lines)
    np.testing.assert_array_equal(
        trigger._controller.bounds, [[-300.0, -300.0, -200.0], [0.0, 0.0, 0.0]]
    )


def test_limits_of_a_build_with_forced_origin_run_upward(machine):
    """Axes that home at their lower end count from 0 there; bit 0 of $23 is x."""
    firmware = FakeGrbl(ball, settings={23: 1})
    firmware.options = "VZ"
    grbl = Grbl.connect(f"tcp://127.0.0.1:{firmware.port}")
    np.testing.assert_array_equal(grbl.bounds, [[0, -300, -200], [300, 0, 0]])
    grbl.close()


def test_without_soft_limits_a_box_is_asked_for(machine):
    with pytest.raises(ValueError, match="give the box"):
        machine(settings={20: 0})
    _, trigger = machine(settings={20: 0}, box=[[-200, -200, -100], [-20, -20, -1]])
    assert trigger.reaches([[-100, -100, -50]])
    with pytest.raises(ValueError, match="lowest corner"):
        machine(box=[[0, 0, 0], [-1, -1, -1]])


def test_a_feed_that_overruns_the_probe_is_refused(machine):
    """From 40 mm/s at 100 mm/s^2 it takes 8 mm to stop."""
    firmware, trigger = machine(options=GuardOptions(travel=40.0))
    with pytest.raises(ValueError, match="stops 8 past a contact"):
        trigger.move([CENTRE + [0, 0, 30.0]])
    assert not any("G38" in line for line in firmware.lines)


def test_a_probe_that_stays_closed_is_found_out_within_the_way_of_release(machine):
    firmware, trigger = machine()
    assert trigger.move([CENTRE + [0, 0, 30.0]])
    assert trigger.probe(CENTRE) is not None
    firmware.stuck = True
    was = firmware.at
    with pytest.raises(MachineFault, match="stays closed 2 from"):
        trigger.move([CENTRE + [0, 0, 30.0]])
    # No farther than release, whatever the way.
    assert np.linalg.norm(firmware.at - was) <= 2.0 + 1e-4


def test_a_probe_in_contact_of_unknown_direction_is_not_moved(machine):
    firmware, trigger = machine(start=CENTRE + [0, 0, 20.9])
    with pytest.raises(MachineFault, match="by hand"):
        trigger.move([CENTRE + [0, 0, 30.0]])
    with pytest.raises(MachineFault, match="before it is to measure"):
        trigger.probe(CENTRE)
    assert not any("G38" in line for line in firmware.lines)


def test_a_probe_that_closes_between_look_and_move_ends_where_it_was(machine):
    """Alarm 4, then ok; grbl is locked until $X."""
    firmware, trigger = machine()
    assert trigger.move([CENTRE + [0, 0, 30.0]])
    grbl, looked = trigger._controller, firmware.closed
    firmware.stuck = True
    hit = grbl.toward(CENTRE, 2.0)
    np.testing.assert_allclose(hit, CENTRE + [0, 0, 30.0], atol=ROUNDING)
    assert not looked
    assert firmware.lines[-1] == "$X"
    assert firmware.state == "Idle"


def test_alarms_resets_and_silence_are_said_in_words(machine):
    firmware, trigger = machine()
    grbl = trigger._controller
    with pytest.raises(MachineFault, match="alarm 2: a target is beyond the soft limits"):
        grbl.toward(np.array([10.0, 0.0, 0.0]), 2.0)
    with pytest.raises(MachineFault, match="error 9, locked by an alarm"):
        grbl.toward(np.array([-10.0, -10.0, -10.0]), 2.0)
    with pytest.raises(MachineFault, match="alarm; home it"):
        grbl._wake()
    firmware.state, firmware.mute = "Idle", True
    with pytest.raises(MachineFault, match="stopped by feed hold and is in the state Hold:0"):
        grbl.toward(firmware.at + 0.1, 2.0)


def test_a_target_where_the_machine_is_needs_no_move(machine):
    """grbl answers it with error 33."""
    _, trigger = machine()
    place = CENTRE + [0, 0, 30.0]
    assert trigger.move([place, place])


@pytest.mark.parametrize(
    "where, words",
    [
        ("tcp://127.0.0.1", "no host and port"),
        ("tcp://127.0.0.1:70000", "no host and port"),
        ("tcp://127.0.0.1:1", "cannot be connected"),
    ],
)
def test_addresses_that_lead_nowhere_are_refused(where, words):
    with pytest.raises(ValueError, match=words):
        open_lines(where)


def test_a_serial_url_is_read_like_a_socket():
    """pyserial's socket://, in place of a cable, goes through the code of serial ports."""
    serial = pytest.importorskip("serial", reason="pyserial is not installed")
    from touchatlas.planner.drivers.lines import SerialLines

    firmware = FakeGrbl(ball)
    lines = SerialLines(f"socket://127.0.0.1:{firmware.port}")
    grbl = Grbl(lines, patience=1.0)
    assert not grbl.closed()
    np.testing.assert_allclose(grbl.position(), firmware.at)
    grbl.close()
    with pytest.raises(ValueError, match="cannot be opened"):
        SerialLines("/dev/no-such-port")
    assert serial.__version__


def test_lines_of_a_serial_port_come_whole():
    """A pseudo-terminal is a serial port to pyserial; lines come in pieces, and several at once."""
    pytest.importorskip("serial", reason="pyserial is not installed")
    controller, port = pty.openpty()
    tty.setraw(port)
    lines = open_lines(os.ttyname(port))
    os.write(controller, b"<Idle|MPos:0.0")
    assert lines.read(0.05) is None
    os.write(controller, b"00,1.000,2.000>\r\nok\r\n")
    assert lines.read(1.0) == "<Idle|MPos:0.000,1.000,2.000>"
    assert lines.read(1.0) == "ok"
    lines.write(b"?")
    assert os.read(controller, 9) == b"?"
    lines.close()
    for end in (controller, port):
        os.close(end)


def test_lateness_is_uniform_over_a_period():
    """Moments of a uniform law, by 1e5 draws: three standard errors of mean and of deviation."""
    draws = np.random.default_rng(0).uniform(0.0, 5.0 * 1e-3, 100_000)
    bias, std = lateness(5.0, 1e-3)
    assert bias == pytest.approx(draws.mean(), abs=3 * std / 316)
    assert std == pytest.approx(draws.std(), rel=0.01)
    assert late(Tip(noise_std=0.003), 5.0, 0.0).noise_std == 0.003
    assert late(Tip(noise_std=0.0), 5.0, 1e-3).noise_std == std
