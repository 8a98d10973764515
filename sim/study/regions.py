"""Atlases of many touches: regions of a journal are learned on workers, and joined."""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.atlas.check.doubt import count_of
from touchatlas.atlas.records.options import AtlasOptions, Levels
from touchatlas.atlas.regions import (
    Region,
    joined,
    learn_region,
    load_part,
    regions_of,
    save_part,
)
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.option_tables import updated
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_folder import read_settings
from touchatlas.sim.folder.run_lock import locked
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.study.cells import Cell, Row
from touchatlas.sim.study.study import Study, Watch, run
from touchatlas.sim.study.workers import WorkOptions
from touchatlas.sim.world.objects import file_digest

COLUMNS = ("region", "file", "touches", "refused", "samples", "digest", "ended")


def learn_by_regions(
    journal,
    folder,
    tolerance: float,
    most: int = 100,
    overlap: float | None = None,
    options: AtlasOptions = AtlasOptions(),
    scale: float | None = None,
    work: WorkOptions = WorkOptions(),
    watch: Watch = lambda done, total: None,
    say: Callable[[str], None] = lambda words: None,
) -> Atlas:
    """An atlas of the touches of a journal, learned region by region on workers and joined.

    One process learns n touches in a time that grows as their square, regions of bounded size in
    one that grows as n. Called again, it goes on with the regions that are left.

    Parameters
    ----------
    journal : path
        The journal.sqlite of a run, under the same path on all workers. Scans are refused.
    folder : path
        For an atlas of each region, and regions.csv and times.csv, which say what became of it;
        under the same path on all workers.
    tolerance : float, length
    most : int
        Most touches of a region.
    overlap : float, length, optional
        See ``regions_of``.
    options, scale
        Those of ``Atlas``.
    work : WorkOptions
    watch, say : callable
        Called with the numbers of regions done and of all; with sentences.

    Returns
    -------
    Atlas
        Not yet finished. It is the same, byte for byte, on any number of workers.

    Raises
    ------
    ValueError
        When a region was not learned, and why.

    Examples
    --------
    ::

        atlas = learn_by_regions("RUN/journal.sqlite", "regions", 0.1, work=WorkOptions(workers=8))
        atlas.finish()
    """
    check_number("tolerance", tolerance)
    journal, folder = Path(journal).resolve(), Path(folder).resolve()
    if not journal.is_file():
        raise ValueError(f"{journal} is no file; give the journal.sqlite of a run")
    with closing(Journal(journal)) as file:
        touches, scans = file.touches(), file.scans()
    if scans:
        raise ValueError(f"{journal} has scans, which have no regions; give a journal of touches")
    digest, cells = file_digest(journal), []
    for number, region in enumerate(regions_of(touches, most, overlap)):
        head = {"region": str(number), "file": f"region-{number}.npz"}
        places = [some.tolist() for some in (region.own, region.around)]
        given = str(journal), digest, *places, tolerance, asdict(options), scale
        cells.append(Cell("regions.csv", head, (*given, str(folder), head["file"])))
    make_out_folder(folder)
    with locked(folder):
        study = Study("regions", COLUMNS, measure_region, "ended", timed=("seconds",))
        rows = run(study, cells, folder, watch, work, say)
        parts = [_part(folder, row) for row in rows]
    if refused := sum(int(row["refused"]) for row in rows):
        say(f"{count_of(refused, 'touch', 'touches')} taught nothing; see {folder / 'regions.csv'}")
    return joined(parts)


def options_of_run(folder) -> tuple[float, AtlasOptions, float | None]:
    """Tolerance, length, and the options and scale, length, of the atlas of a run.

    Raises
    ------
    ValueError
        When the folder holds no run.
    """
    settings = read_settings(folder)
    options = updated(AtlasOptions(), settings.get("atlas", {}), f"{folder}/run.toml", ("atlas",))
    return settings["tolerance"], options, settings.get("scale")


def measure_region(
    journal: str,
    digest: str,
    own,
    around,
    tolerance: float,
    options: dict,
    scale: float | None,
    folder: str,
    name: str,
) -> list[Row]:
    """Learn a region, write its atlas to a file of a folder, and say what it has."""
    if file_digest(journal) != digest:
        raise ValueError(f"{journal} is another here; copy the same to all machines")
    with closing(Journal(journal)) as file:
        touches = file.touches()
    begun, levels = time.process_time(), Levels(**options["levels"])
    given = AtlasOptions(**options | {"levels": levels})
    region = Region(*(np.array(some, int) for some in (own, around)))
    part, refused = learn_region(touches, region, tolerance, given, scale)
    save_part(Path(folder) / name, part)
    found = {
        "touches": str(len(own)),
        "refused": str(len(refused)),
        "samples": str(len(part.of)),
        "digest": file_digest(Path(folder) / name),
        "seconds": f"{time.process_time() - begun:.1f}",
    }
    return [found]


def _part(folder: Path, row: Row):
    """The part of a row; ValueError where there is none."""
    if row["ended"]:
        raise ValueError(f"region {row['region']} was not learned: {row['ended']}")
    path = folder / row["file"]
    if not path.is_file() or file_digest(path) != row["digest"]:
        raise ValueError(f"{path} is not what was learned; give another folder")
    return load_part(path)
