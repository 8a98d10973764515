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
    from touchatlas.planner.drivers.linuxcnc_files import linuxcnc_program, log_name, touch_of_log
    from touchatlas.planner.drivers.linuxcnc_live import LinuxCnc
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
__getattr__ = lazy_names(
    {
        "Controller": "touchatlas.planner.drivers.guarded",
        "Grbl": "touchatlas.planner.drivers.grbl",
        "GuardOptions": "touchatlas.planner.drivers.guarded",
        "GuardedTrigger": "touchatlas.planner.drivers.guarded",
        "LinuxCnc": "touchatlas.planner.drivers.linuxcnc_live",
        "MachineFault": "touchatlas.planner.drivers.guarded",
        "OutOfReach": "touchatlas.planner.drivers.guarded",
        "Qualification": "touchatlas.planner.drivers.qualification",
        "Recording": "touchatlas.planner.drivers.recording",
        "ReplayOptions": "touchatlas.planner.drivers.replay",
        "linuxcnc_program": "touchatlas.planner.drivers.linuxcnc_files",
        "log_name": "touchatlas.planner.drivers.linuxcnc_files",
        "probe_toml": "touchatlas.planner.drivers.probe_file",
        "qualify": "touchatlas.planner.drivers.qualification",
        "qualify_recording": "touchatlas.planner.drivers.scanned_ball",
        "read_bag": "touchatlas.planner.drivers.bags",
        "read_tip": "touchatlas.planner.drivers.probe_file",
        "robot_of": "touchatlas.planner.drivers.robot",
        "touch_of_log": "touchatlas.planner.drivers.linuxcnc_files",
        "touches_of": "touchatlas.planner.drivers.replay",
    }
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
