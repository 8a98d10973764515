"""touchatlas: the command line."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from touchatlas.sim.command.bars import count_on, follow_on, progress_bar
from touchatlas.sim.command.export import export
from touchatlas.sim.command.fit import fit
from touchatlas.sim.command.outcome import FAILURE, INTERRUPTED, complain, exit_code
from touchatlas.sim.command.stability import chart_stability
from touchatlas.sim.run.interrupt import late_interrupt

app = App(name="touchatlas", help="Learn the shape of an object by touch.")
app.command(fit)
app.command(export)
Json = Annotated[bool, Parameter(negative="", help="Print numbers as JSON on standard output.")]
Force = Annotated[bool, Parameter(negative="", help="Replace the run that the folder holds.")]
_UNSURE = (
    "nowhere is the surface known to within the tolerance; give a larger --tolerance, less --noise "
    "or more touches"
)
_NO_SURFACE = (
    "no touch gave a patch, so there is no surface: tolerance or noise is too large for the "
    "object, or a probe from above does not meet it"
)


def _whole(_type, tokens) -> int:
    """The integer that was written; cyclopts itself would round 1.5."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{text!r} is no whole number") from None


Whole = Annotated[int, Parameter(converter=_whole)]


@app.command
def objects(*, json_: Annotated[Json, Parameter(name="--json")] = False) -> int:
    """List the built-in objects."""
    from touchatlas.sim.world.objects import make_object, object_names

    found = [make_object(name) for name in object_names()]
    rows: list[dict[str, Any]] = [
        {
            "name": obj.name,
            "description": obj.description,
            "extent": [round(float(x), 2) for x in obj.bounds[1] - obj.bounds[0]],
            "noise": obj.noise_std,
            "tolerance": obj.tolerance,
            "euler_characteristic": obj.euler_characteristic,
        }
        for obj in found
    ]
    if json_:
        print(json.dumps(rows, indent=2))
        return 0
    table = Table("name", "extent (mm)", "noise", "tolerance", "what")
    for row in rows:
        extent = " x ".join(f"{x:g}" for x in row["extent"])
        table.add_row(
            row["name"], extent, f"{row['noise']:g}", f"{row['tolerance']:g}", row["description"]
        )
    Console().print(table)
    return 0


@app.command
def explore(
    name: Annotated[str, Parameter(name="OBJECT", show_default=False)],
    /,
    *,
    out: Path | None = None,
    noise: float | None = None,
    tolerance: float | None = None,
    max_touches: Whole | None = None,
    max_length: float | None = None,
    seed: Whole = 0,
    force: Force = False,
    json_: Annotated[Json, Parameter(name="--json")] = False,
) -> int:
    """Explore an object by simulated touch, build its atlas and judge it.

    Parameters
    ----------
    name
        A built-in name (see touchatlas objects) or the path of a mesh file.
    out
        Folder for the run; runs/OBJECT-SEED by default.
    noise
        Standard deviation of each coordinate of each point, in the object's unit.
    tolerance
        How well the surface is wanted, in the object's unit.
    max_touches
        Stop after this many touches.
    max_length
        Stop after this much tracked length.
    seed
        Seed of the probe's noise, and of objects that are random.
    """
    with late_interrupt():
        from touchatlas.sim.run.exploration import RunOptions, run_exploration
        from touchatlas.sim.world.objects import make_object

    options = RunOptions(noise, tolerance, max_touches, max_length, seed)
    obj = make_object(name, seed)
    errors = Console(stderr=True)
    _note_if_open(obj, errors)
    out = Path("runs") / f"{obj.name}-{seed}" if out is None else out
    with progress_bar(errors) as progress:
        result = run_exploration(obj, out, options, force, follow_on(progress, obj.name))
    _print_numbers(result.numbers, f"{obj.name}: {out}", json_)
    return _code_of(result)


@app.command
def evaluate(
    surface: Path,
    /,
    *,
    truth: str | None = None,
    tolerance: float | None = None,
    json_: Annotated[Json, Parameter(name="--json")] = False,
) -> int:
    """Compare a surface with the ground truth, both ways.

    Parameters
    ----------
    surface
        A mesh file, or the folder of a run, of which surface.ply is used.
    truth
        A mesh file or built-in object; the run's own object by default.
    tolerance
        1e-3 of the truth's diagonal, or the run's own, by default.
    """
    with late_interrupt():
        from touchatlas.sim.run.evaluate import evaluate_surface, load_surface
        from touchatlas.sim.run.exploration import check_tolerance, random_streams, truth_of
        from touchatlas.sim.run.run_folder import read_settings
        from touchatlas.sim.world.objects import make_object

    seed = 0
    if surface.is_dir():
        run = read_settings(surface)
        truth = run["object"] if truth is None else truth
        tolerance = run["tolerance"] if tolerance is None else tolerance
        seed, surface = run["seed"], surface / "surface.ply"
    elif not surface.is_file():
        raise ValueError(f"there is no file {surface}; give a mesh file, or the folder of a run")
    if truth is None:
        raise ValueError("no truth was given; name a mesh file or built-in object with --truth")
    vertices, faces, deviation = load_surface(surface)
    obj = make_object(truth, seed)
    tolerance = obj.tolerance if tolerance is None else tolerance
    check_tolerance(tolerance, obj.diagonal)
    rng = random_streams(seed)[1]
    found = evaluate_surface(
        vertices, faces, truth_of(obj, tolerance, rng), tolerance, rng, deviation
    )
    _print_numbers(found.as_dict(), f"{surface} against {obj.name}", json_)
    return 0


@app.command
def chart(
    *families: Annotated[str, Parameter(name="FAMILY", show_default=False)],
    stability: Annotated[bool, Parameter(negative="")] = False,
    out: Path = Path("runs/chart"),
    draws: Whole | None = None,
    seed: Whole = 0,
    json_: Annotated[Json, Parameter(name="--json")] = False,
) -> int:
    """Chart accuracy against speed of one patch: our methods, the paper's, peers'.

    Parameters
    ----------
    families
        With --stability: the families to measure; all of them where none is named.
    stability
        Chart where the methods fail instead: families of ever harder cases.
    out
        Folder for tradeoff.csv and tradeoff.png, or the tables and pictures of the families.
    draws
        Number of scenes of each kind (surface, noise, planes), 50 if not given; with --stability
        of cases of each severity, 25 if not given.
    seed
        Seed of the scenes.
    """
    if stability:
        return chart_stability(families, out, draws, seed, json_)
    if families:
        raise ValueError(f"{families[0]} is a family of --stability; give that, too")
    draws = 50 if draws is None else draws
    from touchatlas.sim.study.paper.tables import check_options
    from touchatlas.sim.study.tradeoff import measure, overall
    from touchatlas.sim.study.tradeoff_chart import known, make_folder, overall_table, write_chart

    check_options(draws, seed)
    make_folder(out)
    with progress_bar(Console(stderr=True)) as progress:
        rows = measure(draws=draws, seed=seed, watch=count_on(progress, "chart", "cells"))
    write_chart(out, rows)
    if json_:
        found = [{n: v if known(v) else None for n, v in row.items()} for row in overall(rows)]
        print(json.dumps(found, indent=2))
    else:
        Console().print(overall_table(rows))
    return 0


@app.command
def paper(
    *,
    out: Path = Path("runs/paper"),
    draws: Whole = 50,
    seed: Whole = 0,
    json_: Annotated[Json, Parameter(name="--json")] = False,
) -> int:
    """Repeat the paper's tables and figures on simulated objects, its numbers beside ours.

    Parameters
    ----------
    out
        Folder for paper.json, table1.csv and figures 4, 5, 6 and 8.
    draws
        Number of draws of the noise for every number.
    seed
        Seed of the noise.
    """
    with late_interrupt():
        from touchatlas.sim.study.paper.report import json_text, repeat_paper, terminal_tables

    with progress_bar(Console(stderr=True)) as progress:
        numbers = repeat_paper(out, draws, seed, count_on(progress, "paper", "tables"))
    if json_:
        print(json_text(numbers), end="")
    else:
        Console().print(*terminal_tables(numbers))
    return 0


def _note_if_open(obj, console: Console) -> None:
    if not obj.closed:
        note = f"{obj.name} is an open mesh: its surface will be open too."
        console.print(note, markup=False, highlight=False, soft_wrap=True)


def _code_of(result) -> int:
    """Exit code of a finished run; prints a sentence where there is no surface."""
    if result.interrupted:
        return INTERRUPTED
    if result.surface is None:
        return complain(_NO_SURFACE, FAILURE)
    return 0 if len(result.surface.faces) else complain(_UNSURE, FAILURE)


def _print_numbers(numbers: dict, title: str, as_json: bool) -> None:
    if as_json:
        print(json.dumps(numbers, indent=2))
        return
    table = Table("quantity", "value", title=escape(title))
    for name, value in numbers.items():
        table.add_row(name, f"{value:.5g}" if isinstance(value, float) else str(value))
    Console().print(table)


def main() -> None:
    """Entry point."""
    sys.exit(
        exit_code(lambda: app(exit_on_error=False, print_error=False, result_action="return_value"))
    )
