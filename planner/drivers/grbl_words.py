"""What grbl 1.1 answers, and its alarms and errors in words.

The wording follows doc/csv of its source.
"""

import re
from dataclasses import dataclass, field

import numpy as np

from touchatlas.planner.drivers.guarded import MachineFault

ALARMS = {
    1: "a limit switch was hit; the position is lost, so home again",
    2: "a target is beyond the soft limits",
    3: "it was reset while it moved; the position is lost, so home again",
    4: "the probe was not in the state that the move begins with",
    5: "the probe met nothing on its way",
    6: "homing was interrupted",
    7: "the door was opened while it homed",
    8: "homing did not come free of the limit switch",
    9: "homing did not find the limit switch",
    10: "homing did not find the second limit switch of an axis",
}
# The alarm that a move with G38.3 or G38.5 ends with, and goes on after: ok follows, then $X.
STATE = 4
# The error of a move to where the machine is; positions are reported with less digits.
THERE = "error:33"
_ERRORS = {
    1: "a word without a letter",
    2: "a number that cannot be read",
    3: "an unknown $ command",
    8: "a $ command that has to wait until the machine is idle",
    9: "locked by an alarm or a jog",
    11: "a line that is too long",
    13: "the safety door is open",
    20: "an unsupported command",
    22: "no feed rate",
}


@dataclass(frozen=True, eq=False)
class Status:
    """A status report.

    Parameters
    ----------
    state : str
        Idle, Run, Hold:0, Alarm, Door:1, Check, ...
    values : dict of str to str
        MPos or WPos, Pn, WCO, FS and what else the report holds.
    """

    state: str
    values: dict[str, str] = field(default_factory=dict)

    @property
    def closed(self) -> bool:
        """Whether the probe is in contact."""
        return "P" in self.values.get("Pn", "")


def status_of(line: str) -> Status | None:
    """The status report of a line ``<...>``; None for another line.

    >>> status_of("<Idle|MPos:0.000,1.000,-2.500|FS:0,0|Pn:P>").closed
    True
    """
    if not (line.startswith("<") and line.endswith(">")):
        return None
    state, *rest = line[1:-1].split("|")
    return Status(state, dict(part.partition(":")[::2] for part in rest))


def numbers_of(text: str) -> np.ndarray:
    """The first three of numbers with commas, (3,).

    >>> numbers_of("1.5,-2,3,0")
    array([ 1.5, -2. ,  3. ])
    """
    try:
        values = np.array([float(cell) for cell in text.split(",")[:3]])
    except ValueError:
        values = np.zeros(0)
    if len(values) != 3:
        raise MachineFault(f"the controller sent {text!r} where three coordinates were expected")
    return values


def probed_of(answer: list[str]) -> tuple[np.ndarray, bool] | None:
    """Place (3,) and success of the last ``[PRB:x,y,z:1]`` in an answer; None where there is none.

    >>> probed_of(["[PRB:1.000,2.000,-3.500:0]"])
    (array([ 1. ,  2. , -3.5]), False)
    """
    found = [re.fullmatch(r"\[PRB:([^:]*):([01])\]", line) for line in answer]
    last = next((match for match in reversed(found) if match), None)
    return None if last is None else (numbers_of(last[1]), last[2] == "1")


def alarm_of(answer: list[str]) -> int | None:
    """Number of the last ``ALARM:n`` of an answer."""
    found = [int(n) for line in answer for n in re.findall(r"^ALARM:(\d+)$", line)]
    return found[-1] if found else None


def error_words(line: str) -> str:
    """``error:n`` in words.

    >>> error_words("error:9")
    'error 9, locked by an alarm or a jog'
    """
    number = line.partition(":")[2]
    known = _ERRORS.get(int(number), "") if number.isdigit() else ""
    return f"error {number}" + (f", {known}" if known else "")
