"""touchatlas regions: the command."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from touchatlas.atlas import extract_surface, save_atlas
from touchatlas.atlas.files import write_whole
from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.command.work_flags import Work
from touchatlas.sim.folder.ply import ply_bytes, stored
from touchatlas.sim.folder.run_folder import read_settings, write_settings
from touchatlas.sim.study.regions import (
    learn_by_regions,
    options_of_run,
    take_regions_folder,
)
from touchatlas.sim.study.workers import WorkOptions


def regions(
    run: Annotated[Path, Parameter(name="RUN", show_default=False)],
    /,
    *,
    out: Path | None = None,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    most: Whole = 100,
    overlap: Annotated[float | None, Parameter(show_default=False)] = None,
    tolerance: Annotated[float | None, Parameter(show_default=False)] = None,
    work: Work = WorkOptions(),
    json_: Json = False,
) -> int:
    """Learn the many touches of a large part by regions, here or on a cluster: one atlas.

    What a touch costs grows with all that are known; regions of a bounded number of touches are
    learned apart, each with the touches around it, and joined. A call that was interrupted goes on
    with the regions that are left.

    Parameters
    ----------
    run
        The folder of a run, whose journal.sqlite holds the touches, under the same path on all
        workers.
    out
        Folder for atlas.npz, surface.ply and an atlas of each region, under the same path on all
        workers; RUN/regions by default.
    force
        Replace the regions of another run that the folder holds.
    most
        Most touches of a region.
    overlap
        How far around its own contacts a region takes others' touches, length. The median reach of
        a touch by default.
    tolerance
        Of the surface, length; that of the run by default.
    """
    folder = run / "regions" if out is None else out
    with shown("reading the touches") as watcher:
        own, options, scale = options_of_run(run)
        wanted = own if tolerance is None else tolerance
        given = run / "journal.sqlite", folder, wanted, most, overlap, options, scale
        watcher.begins("learning")
        atlas = learn_by_regions(
            *given,
            work=work,
            watch=watcher.count("regions"),
            say=say,
            take=lambda _: take_regions_folder(folder, run, force),
        )
        watcher.begins("finishing the atlas")
        atlas.finish()
        save_atlas(folder / "atlas.npz", atlas)
        # Its tolerance, unit and truth, which export and evaluate read.
        write_settings(folder, read_settings(folder) | {"tolerance": atlas.tolerance})
        watcher.begins("extracting the surface")
        surface = stored(extract_surface(atlas), atlas.tolerance)
        write_whole(folder / "surface.ply", ply_bytes(surface, atlas.tolerance))
    numbers = {
        "touches": atlas.touches,
        "points": atlas.point_count,
        "faces": len(atlas.faces()),
        "patches": len(atlas),
        "triangles": len(surface.faces),
        "tolerance": atlas.tolerance,
    }
    if json_:
        print(json.dumps(numbers, indent=2))
        return 0
    table = Table("quantity", "value", title=f"{folder}")
    for name, value in numbers.items():
        table.add_row(name, f"{value:.8g}")
    Console().print(table)
    return 0
