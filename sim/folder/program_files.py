"""Programs for LinuxCNC from the plans of a run, and the logs that they write as answers."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from touchatlas.atlas import Touch
from touchatlas.planner import ProbePlan
from touchatlas.planner.drivers.guarded import GuardOptions
from touchatlas.planner.drivers.linuxcnc_files import linuxcnc_program
from touchatlas.planner.drivers.linuxcnc_logs import touch_of_log
from touchatlas.planner.tracking.options import Tip, TriggerOptions
from touchatlas.sim.world.units import MILLIMETRES

_LOG = re.compile(r"touch-(\d{4,})\.txt")


def is_log(path) -> bool:
    """Whether a file has the name of a log of a program."""
    return _LOG.fullmatch(Path(path).name) is not None


def program_of(plans: Sequence[ProbePlan], unit: str) -> str:
    """The program of plans in the unit of their run, mm where it has no name.

    ValueError for a unit that LinuxCNC has not.
    """
    options, motion, named = _moved(unit)
    return linuxcnc_program(plans, options, motion, named)


def touch_of_file(path, plans: Mapping[int, ProbePlan], tip: Tip, unit: str) -> Touch:
    """The touch that a log holds, by the number of the plan in its name.

    ValueError for a plan that is not pending, and for what is no log of it.
    """
    path = Path(path)
    match = _LOG.fullmatch(path.name)
    number = int(match[1]) if match else -1
    if number not in plans:
        which = ", ".join(map(str, plans)) or "none"
        raise ValueError(
            f"{path} is the log of plan {number}, which is not pending (pending: {which}); see "
            "touchatlas next"
        )
    if not path.is_file():
        raise ValueError(f"{path} is no file; give the log that the program wrote")
    options, motion, _ = _moved(unit)
    text = path.read_text(encoding="utf-8", errors="replace")
    try:
        return touch_of_log(text, plans[number], tip, options, motion)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _moved(unit: str) -> tuple[TriggerOptions, GuardOptions, str]:
    """How programs of a run move, and the unit that they are in."""
    named = unit or "mm"
    if named not in ("mm", "in"):
        raise ValueError(f"LinuxCNC has programs in mm and in, and the run is in {unit}")
    millimetre = 1.0 / MILLIMETRES[named]
    return TriggerOptions().in_unit(millimetre), GuardOptions().in_unit(millimetre), named
