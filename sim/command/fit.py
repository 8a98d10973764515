"""touchatlas fit: the command."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

Vector = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def fit(
    contours: Path,
    /,
    *,
    noise: float | None = None,
    method: str = "map",
    point: Vector = None,
    outward: Vector = None,
    columns: str = "",
    unit: str = "",
    tip_radius: float = 0.0,
    tip: Path | None = None,
    out: Path | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Fit a patch to recorded contours: three or more curves through one point.

    Parameters
    ----------
    contours
        A file with a line for each point: the columns curve, x, y, z, and nx, ny, nz of the
        sampling planes or of the surface if known. Separators, names, units and what parts the
        curves are found out, and said; docs/files.md lists what machines write.
    noise
        Standard deviation of each coordinate of a point, in the file's unit. By default it is
        estimated from how far points scatter about smooth arcs along each curve.
    method
        map, the most probable polynomial; monge, the same as a height without terms in z; or the
        paper's total_curvature, excess_curvature and least_squares.
    point
        Reference point, as X,Y,Z; where the curves meet by default.
    outward
        A direction out of the body, as X,Y,Z; by default what normals or approach directions of
        the file tell, else the side to which the surface bulges.
    columns
        Which column is what, as x=3,y=4,z=5,curve=1: numbers from 1, or names of the header; also
        nx, ny, nz, flag (1 where a point is good) and time. By default it is found out.
    unit
        Of the lengths: nm, um, mm, cm, dm, m, in, ft or mil; by default what the file says.
    tip_radius
        Of the ball at the tip, where the file holds its centres, as it does of most machines; it is
        taken off along the normals. Say --outward if the surface does not bulge.
    tip
        A probe.toml that touchatlas qualify wrote, in place of the radius: text files with columns
        time, x, y, z, fx, fy, fz, and bags of ROS, are read as arms in contact.
    out
        Folder for patch.json, patch.ply and patch.png; without, no file is written.
    force
        Replace such files that the folder holds.
    json_
        Print numbers as JSON on standard output.
    """
    from touchatlas.sim.recorded.curves import ReadOptions
    from touchatlas.sim.recorded.fit_file import fit_file, parse_vector
    from touchatlas.sim.recorded.fit_flags import MEANING
    from touchatlas.sim.recorded.fit_report import check_folder

    at = None if point is None else parse_vector(point, "--point")
    side = None if outward is None else parse_vector(outward, "--outward")
    folder = None if out is None else check_folder(out, force)
    read = ReadOptions(columns, unit, tip_radius, tip="" if tip is None else str(tip))
    report = fit_file(contours, method, noise, at, side, read)
    if folder is not None:
        report.write(folder)
    if json_:
        print(report.json())
        return 0
    table = Table("quantity", "value", "unit", title=escape(f"{contours}: {method}"))
    for name, value in report.summary().items():
        table.add_row(name, value, report.units.get(name, "–"))
    console = Console()
    console.print(table)
    for sentence in report.warnings:
        console.print(f"warning: {sentence}", markup=False, highlight=False)
    console.print(f"read: {'; '.join(report.assumed)}", markup=False, highlight=False)
    for flag in report.flags:
        console.print(f"{flag}: {MEANING[flag]}", markup=False, highlight=False)
    for sentence in report.advice:
        console.print(f"advice: {sentence}", markup=False, highlight=False)
    return 0
