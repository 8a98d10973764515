"""LinuxCNC as a ``Controller``, by its own Python module, which Debian's package brings.

It runs in any process on the machine where LinuxCNC runs, or as its display. Places here are in the
active work system, without rotation.
"""

import math
import time

import numpy as np

from touchatlas.planner.drivers.guarded import MachineFault, check_overtravel, millimetres_of

_MODES = "G17 G40 G80 G90 G94"


class LinuxCnc:
    """A running LinuxCNC, ready to probe.

    Parameters
    ----------
    unit : str
        mm or in: that of all places and feeds here.
    overtravel : float, length
        How far the probe may be pushed past its contact. Feeds from which the machine cannot stop
        in this way are refused.
    patience : float, s
        How long a command may take, beyond the time of the move.

    Raises
    ------
    MachineFault
        LinuxCNC is not there, not on, not homed, or its work system is rotated.
    """

    def __init__(self, unit: str = "mm", overtravel: float = 2.0, patience: float = 5.0) -> None:
        self._millimetres = millimetres_of(unit)
        try:
            import linuxcnc
        except ImportError:
            raise ValueError(
                "LinuxCNC's Python module is not here; it comes with LinuxCNC (in Debian with "
                "linuxcnc-uspace), for the system's own Python"
            ) from None
        self._api, self._patience, self._overtravel = linuxcnc, patience, overtravel
        try:
            self._stat, self._command = linuxcnc.stat(), linuxcnc.command()
            self._errors = linuxcnc.error_channel()
            self._stat.poll()
        except linuxcnc.error as error:
            raise MachineFault(f"LinuxCNC does not answer ({error}); start it first") from None
        # Units of the machine in a millimetre, and in a unit of ours.
        self._units = self._stat.linear_units * self._millimetres
        self._check_ready()
        self.period = 1e-9 * float(
            linuxcnc.ini(self._stat.ini_filename).find("EMCMOT", "SERVO_PERIOD") or 1e6
        )
        self._do(_MODES)

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) limits of the axes in work coordinates."""
        axes = self._polled().axis[:3]
        limits = [[axis[f"{end}_position_limit"] for axis in axes] for end in ("min", "max")]
        return np.array([self._place(row) for row in limits])

    def closed(self) -> bool:
        """Whether the probe is in contact."""
        return bool(self._polled().probe_val)

    def position(self) -> np.ndarray:
        """(3,) where the machine is, in work coordinates."""
        return self._place(self._polled().actual_position[:3])

    def toward(self, target: np.ndarray, feed: float) -> np.ndarray | None:
        """Go straight to a target and stop at contact: where it began, or None."""
        return self._probed("G38.3", target, feed)

    def away(self, target: np.ndarray, feed: float) -> bool:
        """Go straight to a target and stop where contact ends: whether it ended."""
        return self._probed("G38.5", target, feed) is not None

    def _probed(self, word: str, target, feed: float) -> np.ndarray | None:
        """Work coordinates (3,) where a probing move ended by its probe, or None."""
        stat = self._polled()
        # The planner of motion brakes with half of the acceleration, and two periods late.
        stop = feed * feed * self._units / stat.max_acceleration + 2.0 * feed * self.period
        check_overtravel(stop, feed, self._overtravel)
        length = float(np.linalg.norm(target - self._place(stat.actual_position[:3])))
        if length * self._millimetres < 1e-5:
            return None
        places = " ".join(
            f"{axis}{x:.6f}" for axis, x in zip("XYZ", target * self._millimetres, strict=True)
        )
        override = max(float(stat.feedrate), 1e-3)
        self._do(
            f"G21 {word} {places} F{60.0 * feed * self._millimetres:.3f}",
            length / (feed * override) + self._patience,
        )
        stat = self._polled()
        # A miss leaves a place as well; the flag alone tells.
        return self._place(stat.probed_position[:3]) if stat.probe_tripped else None

    def _place(self, machine) -> np.ndarray:
        """(3,) work coordinates of coordinates and units of the machine."""
        stat = self._stat
        offsets = (stat.g5x_offset, stat.g92_offset, stat.tool_offset)
        return (np.array(machine) - np.sum([o[:3] for o in offsets], axis=0)) / self._units

    def _polled(self):
        """The state of the machine, now."""
        self._stat.poll()
        return self._stat

    def _check_ready(self) -> None:
        """Refuse a machine that cannot be moved, or whose work system is rotated."""
        stat, api = self._polled(), self._api
        if stat.task_state != api.STATE_ON:
            raise MachineFault("LinuxCNC is not on; reset its emergency stop and switch it on")
        if not all(stat.homed[: stat.joints]):
            raise MachineFault("LinuxCNC is not homed; home all joints")
        if not math.isclose(stat.rotation_xy, 0.0, abs_tol=1e-12):
            raise MachineFault(
                f"the active work system is rotated by {stat.rotation_xy:g} degrees; set it to 0 "
                "(G10 L2 P0 R0)"
            )
        self._command.mode(api.MODE_MDI)
        self._command.wait_complete(self._patience)

    def _do(self, line: str, seconds: float | None = None) -> None:
        """Carry out a line of G-code and wait for its end.

        ``wait_complete`` says done too early and of failures too: the state is asked instead.
        """
        while self._errors.poll():
            pass
        self._command.mdi(line)
        end = time.monotonic() + (self._patience if seconds is None else seconds)
        while time.monotonic() < end:
            stat = self._polled()
            if stat.echo_serial_number >= self._command.serial and stat.state != self._api.RCS_EXEC:
                break
            time.sleep(0.001)
        else:
            self._command.abort()
            raise MachineFault(f"LinuxCNC did not end {line} in time; the move was stopped")
        words = []
        while said := self._errors.poll():
            if said[0] in (self._api.NML_ERROR, self._api.OPERATOR_ERROR):
                words.append(said[1].strip())
        if words:
            raise MachineFault(f"LinuxCNC refused {line}: {'; '.join(words)}")
