"""touchatlas export: the command."""

from collections import Counter
from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

if TYPE_CHECKING:
    from touchatlas.atlas import Atlas

_STEP, _GRAPH = (".step", ".stp"), (".json", ".graphml")


def export(
    run: Path,
    file: Path,
    /,
    *,
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Write the atlas of a run for CAD systems, or the graph of its faces.

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
        Ending in .step or .stp for CAD, in .json or .graphml for the graph of faces; one that is
        there is replaced.
    json_
        Print numbers as JSON on standard output.
    """
    from touchatlas.atlas import load_atlas, save_step

    _check(run, file)
    atlas = load_atlas(run / "atlas.npz")
    is_step = file.suffix.lower() in _STEP
    numbers = asdict(save_step(atlas, file)) if is_step else _write_graph(atlas, file)
    if json_:
        print(dumps(numbers, indent=2))
        return 0
    table = Table("quantity", "value", title=escape(f"{run}: {file}"))
    for name, value in numbers.items():
        if value != "":
            table.add_row(name, escape(value) if isinstance(value, str) else f"{value:.5g}")
    Console().print(table)
    return 0


def _write_graph(atlas: "Atlas", file: Path) -> dict[str, Any]:
    """Write the graph of faces, and say how many faces and edges there are of each kind."""
    from touchatlas.atlas import write_graphml, write_json

    faces = atlas.body.faces if atlas.body is not None else atlas.faces()
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
    if file.suffix.lower() not in (*_STEP, *_GRAPH):
        raise ValueError(
            f"{file} ends in {file.suffix!r}; give a file that ends in .step or .stp for CAD, in "
            ".json or .graphml for the graph of faces"
        )
    if file.is_dir():
        raise ValueError(f"{file} is a folder; give a file for the atlas")
    if not file.parent.is_dir():
        raise ValueError(f"{file.parent} is not a folder; make it, or give another for the file")
