"""Drivers of real machines: controllers with a touch probe, their programs, logs and recordings."""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.planner.drivers.bags import read_bag
    from touchatlas.planner.drivers.grbl import Grbl
    from touchatlas.planner.drivers.guarded import (
        Controller,
        GuardedTrigger,
        GuardOptions,
        MachineFault,
        OutOfReach,
    )
    from touchatlas.planner.drivers.linuxcnc_files import linuxcnc_program, log_name
    from touchatlas.planner.drivers.linuxcnc_live import LinuxCnc
    from touchatlas.planner.drivers.linuxcnc_logs import touch_of_log
    from touchatlas.planner.drivers.probe_file import probe_toml, read_tip
    from touchatlas.planner.drivers.qualification import Qualification, qualify
    from touchatlas.planner.drivers.recording import Recording
    from touchatlas.planner.drivers.replay import ReplayOptions, touches_of
    from touchatlas.planner.drivers.robot import robot_of
    from touchatlas.planner.drivers.scanned_ball import qualify_recording

__all__ = [
    "Controller",
    "Grbl",
    "GuardOptions",
    "GuardedTrigger",
    "LinuxCnc",
    "MachineFault",
    "OutOfReach",
    "Qualification",
    "Recording",
    "ReplayOptions",
    "linuxcnc_program",
    "log_name",
    "probe_toml",
    "qualify",
    "qualify_recording",
    "read_bag",
    "read_tip",
    "robot_of",
    "touch_of_log",
    "touches_of",
]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "bags": "read_bag",
        "grbl": "Grbl",
        "guarded": "Controller GuardOptions GuardedTrigger MachineFault OutOfReach",
        "linuxcnc_files": "linuxcnc_program log_name",
        "linuxcnc_logs": "touch_of_log",
        "linuxcnc_live": "LinuxCnc",
        "probe_file": "probe_toml read_tip",
        "qualification": "Qualification qualify",
        "recording": "Recording",
        "replay": "ReplayOptions touches_of",
        "robot": "robot_of",
        "scanned_ball": "qualify_recording",
    },
)
