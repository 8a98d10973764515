"""touchatlas learn: the command."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from touchatlas.atlas import Touch
from touchatlas.planner.drivers.bags import is_bag
from touchatlas.planner.drivers.probe_file import read_tip
from touchatlas.sim.command.numbers import Json, print_numbers
from touchatlas.sim.command.option_flags import with_options
from touchatlas.sim.command.outcome import ExitCode, complain, say
from touchatlas.sim.command.show import shown
from touchatlas.sim.folder.answer_files import is_answer, read_answers
from touchatlas.sim.folder.program_files import is_log, touch_of_file
from touchatlas.sim.folder.run_folder import is_learning
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.recorded.curves import ReadOptions
from touchatlas.sim.recorded.fit_file import parse_vector
from touchatlas.sim.recorded.scans import SideOptions, read_scans
from touchatlas.sim.run.learning import begin_with_scans, learn_more, pending_plans
from touchatlas.sim.run.learning_files import Learned
from touchatlas.sim.run.learning_run import NO_OPTIONS, LearnOptions, unit_and_noise

Vector = Annotated[str | None, Parameter(allow_leading_hyphen=True, show_default=False)]
Flag = Parameter(negative="", show_default=False)


@with_options(LearnOptions(), NO_OPTIONS)
def learn(
    files: Annotated[tuple[Path, ...], Parameter(name="FILE", show_default=False)],
    /,
    *,
    options: LearnOptions,
    out: Path | None = None,
    noise: Annotated[tuple[float, ...], Flag] = (),
    unit: str = "",
    columns: str = "",
    tip_radius: float = 0.0,
    tip: Annotated[Path | None, Parameter(show_default=False)] = None,
    systematic_std: float = 0.0,
    outside: Vector = None,
    approach: Vector = None,
    viewpoint: Vector = None,
    no_draw: Annotated[bool, Flag] = False,
    force: Annotated[bool, Flag] = False,
    json_: Json = False,
) -> int:
    """Learn curves, points and scans from files: an atlas, its surface, and what is in doubt.

    Parameters
    ----------
    files
        Files of points, in any mixture: single curves, sections, slices, clouds. Where the first is
        the folder of a run that learns, the others are added to it: such files, and answers to the
        plans of touchatlas next, as CSV with the columns plan, plane, x, y, z, as JSON, or as logs
        of its program. Without
        others its surface, picture and numbers are written.
    out
        Folder for the run; runs/FILE by default.
    noise
        Standard deviation of each coordinate of a point: once for all files, or once for each, in
        their order, as --noise 0.02 --noise 0.05. It is estimated from the points by default.
    unit
        Unit of the lengths, where a file does not say it: nm, um, mm, cm, dm, m, in, ft or mil.
    columns
        What the columns are, where a file does not say it: x=3,y=4,z=5,curve=1.
    tip_radius
        Of the ball at the tip, where files and answers hold its centres; in the unit of the run.
        The surface of the centres is learned, and that less the radius is handed out.
    tip
        A probe.toml that touchatlas qualify wrote, in place of the two others: text files with
        columns time, x, y, z, fx, fy, fz, and bags of ROS, are read as arms in contact; other files
        and answers hold centres.
    systematic_std
        Standard deviation of the error that all points share, as of the radius of the tip.
    outside
        A point near the surface and outside of the body, as X,Y,Z, where nothing else tells the
        outer side.
    approach
        A direction out of the body from which all points were reached, as X,Y,Z.
    viewpoint
        A point from which all points were seen, as X,Y,Z.
    no_draw
        Learn, and leave surface, picture and numbers as they are.
    force
        Replace the run that the folder holds.
    """
    if not files:
        raise ValueError("no file was given; name a file of points, or a run and a file")
    for name, value in (("--tip-radius", tip_radius), ("--systematic-std", systematic_std)):
        if tip is not None and value:
            raise ValueError(f"{name} is {value:g}, but --tip {tip} says it, too; leave one out")
    probe = "" if tip is None else str(tip)
    for std in noise:
        check_number("--noise", std, or_zero=True)
    read = ReadOptions(columns, unit, tip_radius, systematic_std, tip=probe)
    given = {"outside": outside, "approach": approach, "viewpoint": viewpoint}
    sides = SideOptions(
        **{n: None if v is None else parse_vector(v, f"--{n}") for n, v in given.items()}
    )
    with shown("reading files") as watcher:
        if files[0].is_dir() and (is_learning(files[0]) or not is_bag(files[0])):
            learned = _more(files[0], files[1:], noise, read, sides, options, no_draw, watcher)
        else:
            for path in files:
                if (is_answer(path) or is_log(path)) and path.is_file():
                    raise ValueError(
                        f"{path} holds answers to plans; name the run before it: touchatlas learn "
                        f"RUN {path}"
                    )
            found = read_scans(files, noise, read, sides)
            for sentence in found.said:
                say(sentence)
            folder = Path("runs") / files[0].stem if out is None else out
            learned = begin_with_scans(folder, found.scans, options, found.unit, force, watcher)
    return _end(learned, json_)


def _more(run: Path, files, noise, read, sides, options, no_draw: bool, watcher) -> Learned:
    """Learn more files into a run."""
    if not is_learning(run):
        raise ValueError(
            f"{run} is no run that learns from files; give one that touchatlas learn or touchatlas "
            "next began"
        )
    if options != LearnOptions():
        raise ValueError(
            f"{run} has its options already, in run.toml; leave them out, or begin another run"
        )
    unit, own = unit_and_noise(run)
    logs = [path for path in files if is_log(path)]
    answers = [path for path in files if is_answer(path) and not is_log(path)]
    others = [path for path in files if not (is_answer(path) or is_log(path))]
    if answers and noise and len(noise) != 1:
        raise ValueError("give one --noise with answers to plans")
    plans = pending_plans(run) if answers or logs else {}
    measured: list[Touch] = []
    if logs and not read.tip:
        raise ValueError(f"{logs[0]} holds centres of a tip; give --tip with its probe.toml")
    if (answers or logs) and read.tip:
        tip = read_tip(read.tip, unit)
        measured = [touch_of_file(path, plans, tip, unit) for path in logs]
        read = replace(read, tip="", tip_radius=tip.radius, systematic_std=tip.radius_std)
    touches = [
        replace(touch, tip_radius=touch.tip_radius or read.tip_radius)
        for path in answers
        for touch in read_answers(path, plans, noise[0] if noise else own)
    ]
    touches = [
        replace(one, systematic_std=max(one.systematic_std, read.systematic_std)) for one in touches
    ]
    touches += measured
    touches.sort(key=lambda touch: touch.number)
    found = read_scans(others, noise, read, sides, unit) if others else None
    for sentence in found.said if found else ():
        say(sentence)
    return learn_more(run, found.scans if found else [], touches, not no_draw, watcher)


def _end(learned: Learned, as_json: bool) -> int:
    """Print what was learned; returns the exit code."""
    for words in learned.refused:
        say(words)
    if not learned.numbers:
        return 0
    numbers, folder = learned.numbers, learned.folder
    title = (
        f"{folder}: {numbers['predicted_coverage']:.1%} of the surface is expected within "
        f"{numbers['tolerance']:.4g}; touchatlas next {folder} says where to touch."
    )
    print_numbers(numbers, title, as_json, every=True)
    if learned.surface is None or not len(learned.surface.faces):
        words = "nowhere is the surface known; give more points, or a larger --tolerance"
        return complain(words, ExitCode.FAILURE)
    return 0
