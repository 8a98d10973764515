"""touchatlas export: the command."""

import tomllib
from collections import Counter
from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from touchatlas.sim.command.outcome import say
from touchatlas.sim.folder.out_folder import check_out_file
from touchatlas.sim.folder.run_folder import check_beside_runs

if TYPE_CHECKING:
    from touchatlas.atlas import Atlas, Faces

_STEP, _GRAPH, _MESH = (".step", ".stp"), (".json", ".graphml", ".csv"), (".glb", ".3mf")
_ENDINGS = (
    "give a file that ends in .step or .stp for CAD, in .glb or .3mf for the triangles, in .json "
    "or .graphml for the graph of faces, in .csv for their table"
)


def export(
    run: Path,
    file: Path,
    /,
    *,
    unit: str | None = None,
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Write the atlas of a run for other programs: CAD, viewers, printers, graphs and tables.

    A STEP file has one face for each plane, cylinder, cone and sphere where all faces of the body
    obey laws, and one for each rounded edge and corner. A closed body without edges is written as
    smooth Bezier faces, any other as triangles, of both as few as half a tolerance allows. The
    graph has faces as nodes, in words and numbers, and the edges between them with kind, length and
    angle.

    Parameters
    ----------
    run
        The folder of a run.
    file
        Ending in .step or .stp for CAD, in .glb (metres, coloured by deviation) or .3mf
        (millimetres) for triangles, in .json or .graphml for the graph of faces, in .csv for their
        table; one that is there is replaced.
    unit
        Of the lengths of the run, where it does not say: mm, m, in, cm, um or ft. STEP, GLB and 3MF
        files hold a unit; lengths are those of the run in it.
    json_
        Print numbers as JSON on standard output.
    """
    from touchatlas.atlas import load_atlas
    from touchatlas.sim.folder.run_options import check_unit

    _check(run, file)
    check_unit(unit)
    atlas = load_atlas(run / "atlas.npz")
    numbers = _written(atlas, run, file, unit)
    if json_:
        print(dumps(numbers, indent=2))
        return 0
    table = Table("quantity", "value", title=escape(f"{run}: {file}"))
    for name, value in numbers.items():
        if value != "":
            table.add_row(name, escape(value) if isinstance(value, str) else f"{value:.5g}")
    Console().print(table)
    return 0


def _written(atlas: "Atlas", run: Path, file: Path, unit: str | None) -> dict[str, Any]:
    """Write the file, and say what is in it."""
    from touchatlas.atlas.files import write_whole
    from touchatlas.sim.folder.exchange import csv_bytes

    ending = file.suffix.lower()
    if ending == ".csv":
        rows = _faces(atlas).table()
        write_whole(file, csv_bytes(rows))
        return {"faces": len(rows)}
    if ending in _GRAPH:
        return _write_graph(atlas, file)
    known = _unit_of_run(run)
    if unit and known and unit != known:
        raise ValueError(f"unit is {unit}, but {run} is in {known}; leave --unit out")
    numbers = _in_unit(atlas, file, unit or known or "mm")
    if not (unit or known):
        say(f"{run} does not say its unit; it is written as millimetres: say --unit if it is not")
    return numbers


def _in_unit(atlas: "Atlas", file: Path, unit: str) -> dict[str, Any]:
    """Write a file of a format that holds a unit, and say what is in it."""
    from touchatlas.atlas import extract_surface, save_step
    from touchatlas.atlas.files import write_whole
    from touchatlas.sim.folder.exchange import glb_bytes, model_bytes

    if file.suffix.lower() in _STEP:
        return asdict(save_step(atlas, file, unit=unit)) | {"unit": unit}
    surface = extract_surface(atlas)
    if not len(surface.faces):
        raise ValueError("nothing of the surface is known, so there is nothing to write")
    glb = file.suffix.lower() == ".glb"
    content = glb_bytes(surface, atlas.tolerance, unit) if glb else model_bytes(surface, unit)
    write_whole(file, content)
    return {"triangles": len(surface.faces), "unit": "m" if glb else "mm"}


def _unit_of_run(run: Path) -> str:
    """The unit that run.toml names, "" where there is none."""
    try:
        unit = tomllib.loads((run / "run.toml").read_text(encoding="utf-8")).get("unit", "")
    except (OSError, ValueError):
        return ""
    return unit if isinstance(unit, str) else ""


def _faces(atlas: "Atlas") -> "Faces":
    """The faces of the body, or those that are read from samples."""
    body = atlas.without_tip.body
    return atlas.faces() if body is None else body.faces


def _write_graph(atlas: "Atlas", file: Path) -> dict[str, Any]:
    """Write the graph of faces, and say how many faces and edges there are of each kind."""
    from touchatlas.atlas import write_graphml, write_json

    faces = _faces(atlas)
    (write_json if file.suffix.lower() == ".json" else write_graphml)(faces, file)
    kinds = Counter(face.kind for face in faces.faces)
    kinds.update(edge.kind.value for edge in faces.edges)
    counts = {"faces": len(faces), "edges": len(faces.edges), **kinds}
    return counts | {"unexplained": faces.unexplained}


def _check(run: Path, file: Path) -> None:
    """ValueError for a folder without an atlas, or a file name that cannot be written."""
    if not (run / "atlas.npz").is_file():
        raise ValueError(
            f"{run} holds no atlas.npz; give the folder of a run, or run explore first"
        )
    if file.suffix.lower() not in (*_STEP, *_GRAPH, *_MESH):
        raise ValueError(f"{file} ends in {file.suffix!r}; {_ENDINGS}")
    check_out_file(file)
    check_beside_runs(file)
