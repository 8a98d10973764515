"""touchatlas next: the command."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.sim.command.learn import Vector
from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole, with_options
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.folder.out_folder import check_new_file
from touchatlas.sim.folder.program_files import program_of
from touchatlas.sim.folder.run_folder import check_beside_runs, is_empty, is_learning, is_run
from touchatlas.sim.recorded.fit_file import parse_vector
from touchatlas.sim.run.learning import begin_with_start, plans_of
from touchatlas.sim.run.learning_run import NO_OPTIONS, LearnOptions


@with_options(LearnOptions(), NO_OPTIONS)
def next_(
    run: Path,
    /,
    *,
    options: LearnOptions,
    count: Whole = 1,
    start: Vector = None,
    outward: Vector = None,
    noise: Annotated[float | None, Parameter(show_default=False)] = None,
    program: Annotated[Path | None, Parameter(show_default=False)] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
    json_: Json = False,
) -> int:
    """Say where to touch now: a table, and plans.csv and plans.json in the folder of the run.

    The answers go back by touchatlas learn RUN ANSWERS.csv, in the order of the plans. A plan that
    is not answered yet is said again.

    Parameters
    ----------
    run
        The folder of a run that learns from files; a new one, where --start, --outward, --noise and
        --tolerance are given.
    count
        Number of plans, those that are pending among them; there are fewer where the next place
        depends on the answers.
    start
        Where the first touch of a new run is expected to meet the object, as X,Y,Z.
    outward
        Direction from the object to where the probe comes from at the start, as X,Y,Z.
    noise
        Standard deviation of each coordinate of a point that the probe measures.
    program
        A file that gets the plans as a program for LinuxCNC, of probing moves alone. It writes a
        log for each plan, touch-0003.txt for plan 3, in the active work system; learn takes these
        with --tip.
    force
        Replace that file.
    """
    if count < 1:
        raise ValueError(f"--count is {count}; give a whole number, 1 or more")
    if program is not None:
        check_new_file(program, "--program", force)
        check_beside_runs(program)
    if start is not None:
        _begin(run, start, outward, noise, options)
    elif options != LearnOptions() or noise is not None or outward is not None:
        raise ValueError(
            "options belong to a new run; give --start as well, or leave them out for a run that "
            "is there"
        )
    elif not is_learning(run):
        raise ValueError(
            f"{run} is no run that learns from files; begin one with touchatlas learn FILE, or "
            "here with --start, --outward, --noise and --tolerance"
        )
    with shown("choosing where to touch"):
        plans, reason, unit = plans_of(run, count)
    if plans and program is not None:
        write_whole(program, program_of(plans, unit).encode())
    if not plans:
        say(f"there is no further plan: {reason}")
    if json_:
        print((run / "plans.json").read_text(encoding="utf-8"), end="")
        return 0
    if plans:
        _print(plans, f"{run}: where to touch" + (f", in {unit}" if unit else ""))
    return 0


def _begin(run: Path, start: str, outward: str | None, noise: float | None, options) -> None:
    """Begin a run without data."""
    _check_vacant(run)
    if outward is None or noise is None:
        raise ValueError("give --outward and --noise with --start")
    direction = parse_vector(outward, "--outward")
    length = float((direction @ direction) ** 0.5)
    if not length > 0.0:
        raise ValueError("--outward has length 0; give a direction")
    begin_with_start(run, parse_vector(start, "--start"), direction / length, noise, options)


def _check_vacant(run: Path) -> None:
    """ValueError for a folder that a new run cannot have."""
    if is_learning(run):
        raise ValueError(
            f"{run} has begun already, and keeps its start and options; touchatlas next {run} "
            "without these goes on with it, or name another folder"
        )
    if run.exists() and not run.is_dir():
        raise ValueError(f"{run} is a file; name a folder for the run")
    if run.is_dir() and not is_empty(run):
        found = "holds a run of touchatlas explore" if is_run(run) else "is not empty"
        raise ValueError(f"{run} {found}; name another folder")


def _print(plans, title: str) -> None:
    """Print plans as a table, one line each."""
    table = Table("plan", "reason", "point", "normal", "planes", "reach", "step", title=title)
    for plan in plans:
        table.add_row(
            str(plan.number),
            plan.reason.value,
            ", ".join(f"{x:.6g}" for x in plan.reference_point),
            ", ".join(f"{x:.4f}" for x in plan.normal),
            str(len(plan.planes)),
            f"{plan.reach:.4g}",
            f"{plan.step:.4g}",
        )
    Console().print(table)
    print("plans.csv and plans.json have the planes; touchatlas learn RUN FILE takes the answers.")
