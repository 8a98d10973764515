"""grbl 1.1 as a ``Controller``, over a serial port or TCP.

It answers ``[PRB:x,y,z:1]`` in machine coordinates, in the units of setting $13, whatever G20, G21
and the work offset say. Places here are in the work coordinates that are active when it connects.
"""

import re
import time

import numpy as np

from touchatlas.planner.drivers.grbl_words import (
    ALARMS,
    STATE,
    THERE,
    Status,
    alarm_of,
    error_words,
    numbers_of,
    probed_of,
    status_of,
)
from touchatlas.planner.drivers.guarded import (
    MILLIMETRES,
    MachineFault,
    check_overtravel,
    millimetres_of,
)
from touchatlas.planner.drivers.lines import Lines, open_lines

_SILENT = "the controller does not answer; see cable, port and baud rate"


class Grbl:
    """A connection to grbl, ready to probe.

    Parameters
    ----------
    lines : Lines
        The connection.
    unit : str
        mm or in: that of all places and feeds here.
    overtravel : float, length
        How far the probe may be pushed past its contact. Feeds from which the machine cannot stop
        in this way are refused.
    patience : float, s
        How long an answer may take, beyond the time of the move.

    Raises
    ------
    MachineFault
        No answer, an alarm that needs somebody, or a setting that does not suit.
    """

    # The firmware looks at the probe at each step of a motor.
    period = 0.0

    def __init__(
        self, lines: Lines, unit: str = "mm", overtravel: float = 2.0, patience: float = 3.0
    ) -> None:
        self._lines, self._unit, self._patience = lines, millimetres_of(unit), patience
        self._overtravel = overtravel
        self._wake()
        settings = self._settings()
        self._report = MILLIMETRES["in" if settings.get("13", 0.0) == 1.0 else "mm"]
        self._offset = self._work_offset() / self._unit
        self._bounds = self._limits(settings)
        self._slowest = min(settings.get(f"{n}", np.inf) for n in (120, 121, 122)) / self._unit

    @classmethod
    def connect(cls, where: str, baud: int = 115200, **settings) -> "Grbl":
        """Connect to ``tcp://HOST:PORT`` or a serial port such as ``/dev/ttyUSB0``."""
        lines = open_lines(where, baud)
        try:
            return cls(lines, **settings)
        except BaseException:
            lines.close()
            raise

    def close(self) -> None:
        """Close the connection."""
        self._lines.close()

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) limits in work coordinates; infinite where soft limits are off."""
        return self._bounds - self._offset

    def closed(self) -> bool:
        """Whether the probe is in contact."""
        return self._status().closed

    def position(self) -> np.ndarray:
        """(3,) where the machine is, in work coordinates."""
        values = self._status().values
        if "MPos" in values:
            return self._reported(values["MPos"]) - self._offset
        return self._reported(values.get("WPos", ""))

    def toward(self, target: np.ndarray, feed: float) -> np.ndarray | None:
        """Go straight to a target and stop at contact: where it began, or None."""
        hit = self._probed("G38.3", target, feed)
        return None if hit is None else hit - self._offset

    def away(self, target: np.ndarray, feed: float) -> bool:
        """Go straight to a target and stop where contact ends: whether it ended."""
        return self._probed("G38.5", target, feed) is not None

    def _probed(self, word: str, target, feed: float) -> np.ndarray | None:
        """Machine coordinates (3,) where a probing move ended by its probe, or None."""
        stop = feed * feed / (2.0 * self._slowest)
        check_overtravel(stop, feed, self._overtravel)
        start = self.position()
        length = float(np.linalg.norm(target - start))
        # Steps of grbl are coarser than the digits of these millimetres.
        places = "".join(
            f"{axis}{x:.4f}" for axis, x in zip("XYZ", target * self._unit, strict=True)
        )
        # Units and distance mode stand in the line, so that a reset does not change them.
        line = f"G21G90G94{word}{places}F{60.0 * feed * self._unit:.2f}"
        answer = self._command(line, length / feed + self._patience)
        if THERE in answer:
            return None
        if alarm_of(answer) == STATE:
            # The probe has changed since it was looked at: the move has ended where it began.
            self._command("$X", self._patience)
            return self.position() + self._offset
        found = probed_of(answer)
        if found is None:
            raise MachineFault(
                f"the controller did {word} and reported no [PRB:]; see that it is not in check "
                "mode ($C)"
            )
        place, success = found
        # Without success the place may be that of an earlier contact.
        return place * self._report / self._unit if success else None

    def _reported(self, text: str) -> np.ndarray:
        """Coordinates (3,) of a report, in the unit of places here."""
        return numbers_of(text) * self._report / self._unit

    def _wake(self) -> None:
        """Wait until the controller answers; unlock it where that is safe."""
        # Opening a serial port resets the board, which is deaf while it starts.
        end = time.monotonic() + self._patience
        while (status := self._asked(0.5)) is None:
            if time.monotonic() > end:
                raise MachineFault(_SILENT)
        # An empty line ends what another program may have begun.
        self._lines.write(b"\n")
        while self._lines.read(0.1) is not None:
            pass
        state = status.state
        if state.startswith("Alarm"):
            raise MachineFault("the controller is in alarm; home it ($H) or unlock it ($X) first")
        if not state.startswith("Idle"):
            raise MachineFault(f"the controller is in the state {state}; it must be Idle")

    def _settings(self) -> dict[str, float]:
        """The settings $n."""
        found = {}
        for line in self._command("$$", self._patience):
            match = re.match(r"\$(\d+)=([-0-9.]+)", line)
            if match:
                found[match[1]] = float(match[2])
        if "13" not in found:
            raise MachineFault("the controller does not list its settings ($$) as grbl 1.1 does")
        return found

    def _work_offset(self) -> np.ndarray:
        """(3,) from machine to work coordinates, in mm: work system, G92, tool length."""
        modes = " ".join(self._command("$G", self._patience))
        system = re.search(r"\bG5[4-9]\b", modes)
        held: dict[str, str] = {}
        for line in self._command("$#", self._patience):
            name, _, value = line.strip("[]").partition(":")
            held[name] = value
        if system is None or system[0] not in held:
            raise MachineFault("the controller does not say which work system is active ($G, $#)")
        offset = numbers_of(held[system[0]])
        if "G92" in held:
            offset = offset + numbers_of(held["G92"])
        offset[2] += float(held.get("TLO", "0").split(",")[0] or 0.0)
        return offset * self._report

    def _limits(self, settings: dict[str, float]) -> np.ndarray:
        """(2, 3) limits in machine coordinates.

        They run from minus the travel to 0. A build with forced origin (Z among its options) has
        them from 0 to the travel in axes that home at their lower end.
        """
        if settings.get("20", 0.0) != 1.0:
            return np.array([[-np.inf] * 3, [np.inf] * 3])
        travel = np.array([settings.get(str(n), 0.0) for n in (130, 131, 132)]) / self._unit
        build = " ".join(self._command("$I", self._patience))
        forced = "Z" in "".join(re.findall(r"\[OPT:([^,\]]*)", build))
        lower = forced * np.array([int(settings.get("23", 0.0)) >> axis & 1 for axis in range(3)])
        return np.array([(lower - 1) * travel, lower * travel])

    def _status(self) -> Status:
        """The state of the machine."""
        status = self._asked(self._patience)
        if status is None:
            raise MachineFault(_SILENT)
        return status

    def _asked(self, seconds: float) -> Status | None:
        """The answer to a question for the state, None where there is none in time."""
        self._lines.write(b"?")
        end = time.monotonic() + seconds
        while (line := self._lines.read(max(end - time.monotonic(), 0.0))) is not None:
            if (status := status_of(line)) is not None:
                return status
        return None

    def _command(self, line: str, seconds: float) -> list[str]:
        """Send one line; returns what is answered up to its ok.

        An alarm that is followed by ok is in the answer, and so is the error that is none.
        """
        self._lines.write(line.encode() + b"\n")
        answer: list[str] = []
        end = time.monotonic() + seconds
        while (got := self._lines.read(max(end - time.monotonic(), 0.0))) is not None:
            if got == "ok":
                return answer
            if got == THERE:
                return [got]
            if got.startswith("error:"):
                raise MachineFault(f"the controller refused {line}: {error_words(got)}")
            if got.startswith("Grbl "):
                raise MachineFault(f"the controller was reset during {line}; home it again")
            if got and status_of(got) is None:
                answer.append(got)
            alarm = alarm_of([got])
            if alarm is not None and alarm != STATE:
                words = ALARMS.get(alarm, "see grbl's list of alarms")
                raise MachineFault(f"alarm {alarm}: {words}")
        # What is not known to have ended is stopped.
        self._lines.write(b"!")
        raise MachineFault(
            f"no answer to {line} within {seconds:.3g} s; the machine was stopped by feed hold and "
            f"is in the state {self._status().state}"
        )
