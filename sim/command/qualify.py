"""touchatlas qualify: the command."""

import json
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.patch.words import count_of
from touchatlas.planner.drivers.bags import is_bag
from touchatlas.planner.drivers.probe_file import known_of, probe_toml
from touchatlas.planner.drivers.qualification import Qualification
from touchatlas.planner.drivers.qualification import qualify as qualify_points
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.scanned_ball import qualify_recording
from touchatlas.planner.tracking.options import TrackingOptions
from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.outcome import say
from touchatlas.sim.folder.out_folder import check_new_file
from touchatlas.sim.folder.run_folder import check_beside_runs
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.machine.options import ARM, MEASURING, SCANNING, TRIGGER
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import ReadOptions
from touchatlas.sim.recorded.fit_file import parse_vector
from touchatlas.sim.recorded.recorded_arms import is_recording, recording_of
from touchatlas.sim.world.units import UNIT_NAMES, UNITS

Vector = Annotated[str, Parameter(allow_leading_hyphen=True)]
Optional = Annotated[float | None, Parameter(show_default=False)]
SIMULATED = (TRIGGER, SCANNING)
# Of a reading or a point of simulated machines, mm.
NOISE = {ARM: 0.02, MEASURING: 0.002}
# Unit and meaning of the entries of a tip.
_TIP = {
    "radius": ("length", "of the tip as it acts: pre-travel is taken off"),
    "radius_std": ("length", "its standard deviation"),
    "stiffness": ("N/length", "force over bending"),
    "stiffness_std": ("1", "its standard deviation, over itself"),
    "noise_std": ("length", "white noise of a point or reading"),
    "force_std": ("N", "white noise of each component of the force"),
    "error_std": ("length", "what neighbouring readings have in common"),
}


def qualify(
    points: Annotated[Path, Parameter(name="FILE")],
    /,
    *,
    ball: float,
    ball_std: float = 0.0,
    radius: Optional = None,
    stiffness: Optional = None,
    stiffness_std: float = 0.0,
    axis: Vector = "0,0,1",
    least: float = TrackingOptions().least,
    machine: str = ARM,
    seed: Whole = 0,
    unit: str = "",
    columns: str = "",
    pose: str = "",
    wrench: str = "",
    tool: Vector = "0,0,0",
    out: Path = Path("probe.toml"),
    force: Annotated[bool, Parameter(negative="")] = False,
    json_: Json = False,
) -> int:
    """Measure a probe on a ball of known radius: tip, stiffness, noise, errors of form.

    Parameters
    ----------
    points
        Centres of the tip as a file of points; or a recording: a text file with the columns time,
        x, y, z, fx, fy, fz, or a bag of ROS with poses and wrenches; or trigger or scanning, for a
        simulated probe.
    ball
        Radius of the ball, by its certificate.
    ball_std
        Standard deviation of that radius.
    radius
        Radius of the tip that was stated, for the error of size.
    stiffness
        Force over bending that was stated, in N over the unit, where forces do not tell it.
    stiffness_std
        Its standard deviation, over itself.
    axis
        Direction from the ball along the stylus, as X,Y,Z: the pole of the 25 points.
    least
        Readings with less force, in N, are not in contact.
    machine
        That holds the probe where it is simulated: arm, or measuring.
    seed
        Of its noise, and of what its tip truly is.
    unit
        Of the lengths: nm, um, mm, cm, dm, m, in, ft or mil; by default what the file says, and mm
        for a bag.
    columns
        Which column is what, as x=3,y=4,z=5, in a file of points.
    pose
        Topic of the poses of a bag, where it has several.
    wrench
        Topic of the wrenches of a bag, where it has several.
    tool
        Centre of the tip in the frame of the poses of a bag, as X,Y,Z.
    out
        The file that is written.
    force
        Replace it.
    """
    check_new_file(out, "--out", force)
    check_beside_runs(out)
    if unit and unit not in UNITS:
        raise ValueError(f"--unit is {unit!r}; it must be {UNIT_NAMES}")
    if machine not in NOISE:
        raise ValueError(f"--machine is {machine!r}; it must be one of {', '.join(NOISE)}")
    for flag, value in (("--ball", ball), ("--stiffness", stiffness), ("--least", least)):
        check_number(flag, value)
    stds = ("--ball-std", ball_std), ("--stiffness-std", stiffness_std), ("--radius", radius)
    for flag, value in stds:
        check_number(flag, value, or_zero=True)
    known: dict[str, Any] = {"ball_std": ball_std, "radius": radius, "stiffness": stiffness}
    known |= {"stiffness_std": stiffness_std, "axis": _direction(axis)}
    _check_used(points, {"columns": columns, "pose": pose, "wrench": wrench, "tool": tool})
    held: Recording | np.ndarray | None
    if str(points) in SIMULATED:
        if unit not in ("", "mm"):
            raise ValueError(f"simulated probes are in mm, not in {unit}; leave --unit out")
        held, unit = _simulated(str(points), machine, ball, seed), "mm"
    else:
        held = recording_of(points, unit, pose, wrench, parse_vector(tool, "--tool"))
    if isinstance(held, Recording):
        for sentence in held.said:
            say(f"read: {sentence}")
        found, unit = qualify_recording(held, ball, least, **known), held.unit
    elif held is None:
        file = read_curves(points, ReadOptions(columns, unit))
        for sentence in (*file.warnings, f"read: {file.how}"):
            say(sentence)
        found = qualify_points(np.concatenate([c.points for c in file.curves]), ball, **known)
        unit = file.unit
    else:
        found = qualify_points(held, ball, **known)
    source = f"touchatlas qualify {points.name}, {count_of(found.points, 'point')}"
    write_whole(out, probe_toml(found, ball, unit, source, machine).encode())
    _print(found, unit, out, json_)
    return 0


def _check_used(points: Path, given: dict[str, str]) -> None:
    """ValueError for a flag that what is measured has not."""
    own: tuple[str, ...]
    if str(points) in SIMULATED:
        kind, own = "a simulated probe", ()
    elif is_bag(points):
        kind, own = "a bag", ("pose", "wrench", "tool")
    elif is_recording(points):
        kind, own = "text with forces", ()
    else:
        kind, own = "a file of points", ("columns",)
    for name, value in given.items():
        if name not in own and value != signature(qualify).parameters[name].default:
            raise ValueError(
                f"--{name} is {value!r}, but {points} is {kind}, which has none; leave it out"
            )


def _simulated(name: str, machine: str, ball: float, seed: int) -> Recording | np.ndarray:
    """What a simulated probe measures on a ball, mm."""
    from touchatlas.sim.machine.on_a_ball import measured_on_a_ball, probe_before_a_ball
    from touchatlas.sim.machine.options import ProbeOptions

    if seed < 0:
        raise ValueError(f"--seed is {seed}; it must be a whole number, 0 or more")
    options = ProbeOptions(name, machine)
    probe = probe_before_a_ball(options, ball, NOISE[machine], np.random.default_rng(seed))
    return measured_on_a_ball(probe, ball)


def _direction(text: str) -> np.ndarray:
    """(3,) a direction of an option."""
    axis = parse_vector(text, "--axis")
    if not axis.any():
        raise ValueError("--axis has length 0; give a direction")
    return axis


def _print(found: Qualification, unit: str, out: Path, as_json: bool) -> None:
    """Print what was found, and say what to know of it."""
    tip = known_of(found)
    forms = {
        "P_Form.Sph.1x25": (found.form_1x25, "range of 25 points about their ball"),
        "P_Form.Sph.Scan": (found.form_scan, "range of smoothed readings about their ball"),
        "P_Size.Sph": (found.size, "diameter less that of the ball, with the stated radius"),
    }
    if as_json:
        held = {"unit": unit, "points": found.points, "centre": found.centre.tolist(), **tip}
        print(json.dumps(held | {name: value for name, (value, _) in forms.items()}, indent=2))
    else:
        table = Table(
            "quantity", "value", "unit", "", title=f"{out}: {count_of(found.points, 'point')}"
        )
        length = unit or "length"
        for name, value in tip.items():
            table.add_row(
                name, f"{value:.4g}", _TIP[name][0].replace("length", length), _TIP[name][1]
            )
        for name, (form, meaning) in forms.items():
            if form is not None:
                table.add_row(name, f"{form:.4g}", length, meaning)
        Console().print(table)
    for sentence in found.said:
        say(sentence)
