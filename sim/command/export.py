"""touchatlas export: the command."""

from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

_ENDINGS = (".step", ".stp")


def export(
    run: Path,
    file: Path,
    /,
    *,
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Write the atlas of a run as a STEP file: each patch one trimmed face, for CAD systems.

    Parameters
    ----------
    run
        The folder of a run.
    file
        The STEP file, ending in .step or .stp; one that is there is replaced.
    json_
        Print numbers as JSON on standard output.
    """
    from touchatlas.atlas import load_atlas, save_step

    _check(run, file)
    numbers = asdict(save_step(load_atlas(run / "atlas.npz"), file))
    if json_:
        print(dumps(numbers, indent=2))
        return 0
    table = Table("quantity", "value", title=escape(f"{run}: {file}"))
    for name, value in numbers.items():
        table.add_row(name, f"{value:.5g}")
    Console().print(table)
    return 0


def _check(run: Path, file: Path) -> None:
    """ValueError for a folder without an atlas, or a file name that cannot be written."""
    if not (run / "atlas.npz").is_file():
        raise ValueError(
            f"{run} holds no atlas.npz; give the folder of a run, or run explore first"
        )
    if file.suffix.lower() not in _ENDINGS:
        raise ValueError(f"{file} ends in {file.suffix!r}; give a file that ends in .step or .stp")
    if file.is_dir():
        raise ValueError(f"{file} is a folder; give a file for the atlas")
    if not file.parent.is_dir():
        raise ValueError(f"{file.parent} is not a folder; make it, or give another for the file")
