"""Recordings with forces as curves: arms in contact, with the normals that the force shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from touchatlas.patch.words import count_of
from touchatlas.planner.drivers.bags import is_bag, read_bag
from touchatlas.planner.drivers.probe_file import read_tip
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.replay import touches_of
from touchatlas.sim.recorded.curves import Curve, Curves, ReadOptions, check_size
from touchatlas.sim.recorded.force_file import has_forces, read_force_file
from touchatlas.sim.recorded.other_files import read_other
from touchatlas.sim.world.units import MILLIMETRES, UNITS


def is_recording(path) -> bool:
    """Whether a file is a bag, or a text file with columns of forces."""
    path = Path(path)
    return is_bag(path) or path.is_file() and not read_other(path) and has_forces(path)


def with_tip(options: ReadOptions, paths, unit: str) -> ReadOptions:
    """Options in which the tip of a probe.toml stands for itself.

    Recordings with forces are read as contacts, and their points share the error of the radius.
    Other points are centres of the tip.

    Parameters
    ----------
    options : ReadOptions
    paths : sequence of path-like
        All of one kind.
    unit : str
        Of the lengths of the files.

    Raises
    ------
    ValueError
        Files of both kinds, or a file that is no probe.toml.
    """
    if not options.tip:
        return options
    tip, recorded = read_tip(options.tip, unit), [is_recording(path) for path in paths]
    if any(recorded) and not all(recorded):
        raise ValueError(
            f"{paths[recorded.index(False)]} has no forces, but {paths[recorded.index(True)]} has; "
            "learn contacts and centres of a tip in runs of their own"
        )
    if any(recorded):
        return replace(options, systematic_std=tip.radius_std)
    return replace(options, tip="", tip_radius=tip.radius, systematic_std=tip.radius_std)


def recording_of(path, unit: str = "", pose: str = "", wrench: str = "", tool=None):
    """The recording of a bag, or of a text file with columns of forces; None for another file.

    Lengths of a bag are converted from metres, to mm where no unit is named.
    """
    path = Path(path)
    if not is_recording(path):
        return None
    if not is_bag(path):
        return read_force_file(path, unit)
    unit = UNITS[unit] if unit else "mm"
    per_metre = MILLIMETRES["m"] / MILLIMETRES[unit]
    at = np.zeros(3) if tool is None else np.asarray(tool) / per_metre
    held = read_bag(path, pose, wrench, at)
    return Recording(held.times, held.positions * per_metre, held.forces, unit, held.said)


def arms_of(path: Path, options: ReadOptions) -> Curves | None:
    """Curves of a recording, by the tip of a probe.toml; None where the file is no recording.

    Each contour of each touch is a curve with the normals of the surface.
    """
    recording = recording_of(path, options.unit)
    if recording is None:
        return None
    tip = read_tip(options.tip, recording.unit)
    touches = touches_of(recording, tip)
    curves = [
        Curve(f"{touch.number}.{k}", contour.points, None, contour.normals, True)
        for touch in touches
        for k, contour in enumerate(touch.contours)
    ]
    check_size(path, np.concatenate([curve.points for curve in curves]))
    assumed = (
        *recording.said,
        f"{count_of(len(touches), 'touch')} of {count_of(len(curves), 'contour')} in contact",
        f"a tip of radius {tip.radius:.6g} was taken off along normals from the force",
    )
    return Curves(curves, False, assumed, (), recording.unit)
