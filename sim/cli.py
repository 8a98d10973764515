"""touchatlas: the command line."""

import json
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import App, CycloptsError, Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

app = App(name="touchatlas", help="Learn the shape of an object by touch.")
_USER, _FAILURE, _INTERRUPTED = 2, 1, 130
Json = Annotated[bool, Parameter(negative="", help="Print numbers as JSON on standard output.")]
Force = Annotated[bool, Parameter(negative="", help="Replace the run that the folder holds.")]


@app.command
def objects(*, json_: Annotated[Json, Parameter(name="--json")] = False) -> int:
    """List the built-in objects."""
    from touchatlas.sim.objects import make_object, object_names

    found = [make_object(name) for name in object_names()]
    rows = [
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
    max_touches: int | None = None,
    max_length: float | None = None,
    seed: int = 0,
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
        Of the probe's noise, and of objects that are random.
    """
    from touchatlas.sim.objects import make_object
    from touchatlas.sim.run import RunOptions, run_exploration

    options = RunOptions(noise, tolerance, max_touches, max_length, seed)
    obj = make_object(name, seed)
    errors = Console(stderr=True)
    if not obj.closed:
        errors.print(f"{obj.name} is an open mesh: its surface will be open too.")
    out = Path("runs") / f"{obj.name}-{seed}" if out is None else out
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=errors, disable=not errors.is_terminal) as progress:
        task = progress.add_task(obj.name, total=1.0)

        def watch(step, atlas) -> None:
            if step.plan.number % 5 == 0:
                text = (
                    f"touch {step.plan.number} patches {len(atlas)} "
                    f"deviation {atlas.predicted_deviation():.3g}"
                )
                progress.update(task, completed=atlas.predicted_coverage(), description=text)

        result = run_exploration(obj, out, options, force, watch)
    if json_:
        print(json.dumps(result.numbers, indent=2))
    else:
        _print_numbers(result.numbers, f"{obj.name}: {out}")
    return _INTERRUPTED if result.interrupted else 0


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
        A mesh file, or the folder of a run (its surface.ply is meant).
    truth
        A mesh file or built-in object; the run's own object by default.
    tolerance
        1e-3 of the truth's diagonal, or the run's own, by default.
    """
    import tomllib

    import numpy as np

    from touchatlas.sim.evaluate import evaluate_surface
    from touchatlas.sim.mesh_object import load_mesh
    from touchatlas.sim.objects import make_object
    from touchatlas.sim.ply import read_deviation
    from touchatlas.sim.run import truth_of

    seed = 0
    if surface.is_dir():
        if not (surface / "run.toml").is_file() or not (surface / "surface.ply").is_file():
            raise ValueError(f"{surface} is not the folder of a finished run; run explore first")
        run = tomllib.loads((surface / "run.toml").read_text())
        truth = run["object"] if truth is None else truth
        tolerance = run["tolerance"] if tolerance is None else tolerance
        seed, surface = run["seed"], surface / "surface.ply"
    if truth is None:
        raise ValueError("no truth was given; name a mesh file or built-in object with --truth")
    vertices, faces = load_mesh(surface)
    deviation = read_deviation(surface) if surface.suffix == ".ply" else None
    if deviation is not None and len(deviation) != len(vertices):
        deviation = None
    obj = make_object(truth, seed)
    tolerance = obj.tolerance if tolerance is None else tolerance
    rng = np.random.default_rng(seed)
    found = evaluate_surface(
        vertices, faces, truth_of(obj, tolerance, rng), tolerance, rng, deviation
    )
    if json_:
        print(json.dumps(found.as_dict(), indent=2))
    else:
        _print_numbers(found.as_dict(), f"{surface} against {obj.name}")
    return 0


def _print_numbers(numbers: dict, title: str) -> None:
    table = Table("quantity", "value", title=title)
    for name, value in numbers.items():
        table.add_row(name, f"{value:.5g}" if isinstance(value, float) else str(value))
    Console().print(table)


def main() -> None:
    """Entry point: 2 for the user's mistakes, 1 for failures, never a traceback."""
    try:
        code = app(exit_on_error=False, print_error=False, result_action="return_value")
    except (ValueError, CycloptsError) as error:
        code = _complain(error, _USER)
    except (OSError, MemoryError) as error:
        code = _complain(error, _FAILURE)
    except KeyboardInterrupt:
        code = _INTERRUPTED
    sys.exit(code or 0)


def _complain(error: BaseException, code: int) -> int:
    print(f"touchatlas: {error}", file=sys.stderr)
    return code
