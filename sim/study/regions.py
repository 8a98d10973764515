"""Atlases of many touches: regions of a journal are learned on workers, and joined."""

import os
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.atlas.records.options import AtlasOptions, Levels
from touchatlas.atlas.regions import Region, joined, learn_region, load_part, regions_of, save_part
from touchatlas.patch.words import count_of
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.option_tables import updated
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_folder import (
    REGIONS_OF,
    check_explored,
    own_settings,
    read_settings,
    run_of_regions,
    write_settings,
)
from touchatlas.sim.folder.run_lock import locked
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.study.cells import LEDGER, Cell, Row, keep_answers, kept_answers
from touchatlas.sim.study.study import Study, Watch, run
from touchatlas.sim.study.taken_folder import check_replaced, remove_files
from touchatlas.sim.study.workers import WorkOptions
from touchatlas.sim.world.objects import file_digest

COLUMNS = ("region", "file", "touches", "refused", "why", "samples", "digest", "ended")
# What is made of the regions, beside their own files.
FILES = ("run.toml", "atlas.npz", "surface.ply", "regions.csv", "times.csv", LEDGER)


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
    take: Callable[[Path], object] = make_out_folder,
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
    take : callable
        Makes the folder when it is known what is to be learned.

    Returns
    -------
    Atlas
        Not yet finished. It is the same, byte for byte, on any number of workers.

    Raises
    ------
    ValueError
        For what has no regions.
    OSError
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
    take(folder)
    with locked(folder):
        _forget_changed(folder, cells)
        study = Study("regions", COLUMNS, measure_region, "ended", timed=("seconds",))
        rows = run(study, cells, folder, watch, work, say)
        parts = [_part(folder, row) for row in rows]
        others = {path.name for path in folder.glob("region-*.npz")} - {row["file"] for row in rows}
        remove_files(folder, others)
    if not any(len(part.atlas.pool) for part in parts):
        raise ValueError(
            f"no region of {journal} has a sample, as {folder / 'regions.csv'} lists; give a "
            "larger --tolerance, or first go on with the run to more touches"
        )
    if refused := sum(int(row["refused"]) for row in rows):
        say(f"{count_of(refused, 'touch')} taught nothing; see {folder / 'regions.csv'}")
    return joined(parts)


def take_regions_folder(folder: Path, run: Path, force: bool) -> None:
    """Make a folder for the regions of a run, or take it over, and say there whose they are.

    Raises
    ------
    ValueError
        When it is the run itself, or holds something that is not the regions of this run, unless
        it is regions of another that are to be replaced by ``force``.
    """
    own = os.path.relpath(run.resolve(), folder.resolve())
    if own == ".":
        raise ValueError(
            f"{folder} is the run itself, whose atlas would be lost; give another --out"
        )
    make_out_folder(folder)
    with locked(folder):
        settings = own_settings(folder)
        if settings.get(REGIONS_OF) != own:
            held = run_of_regions(folder, settings)
            words = "" if held is None else f"regions of {held}"
            check_replaced(folder, "set of regions", words, FILES, force)
            remove_files(folder, () if held is None else FILES)
            write_settings(folder, read_settings(run) | {REGIONS_OF: own})


def options_of_run(folder) -> tuple[float, AtlasOptions, float | None]:
    """Tolerance, length, and the options and scale, length, of the atlas of a run.

    Raises
    ------
    ValueError
        When the folder holds no run.
    """
    settings = read_settings(folder)
    check_explored(folder, settings)
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
        "why": "; ".join(refused),
        "samples": str(len(part.of)),
        "digest": file_digest(Path(folder) / name),
        "seconds": f"{time.process_time() - begun:.1f}",
    }
    return [found]


def _forget_changed(folder: Path, cells: list[Cell]) -> None:
    """Forget answers whose files are not as they were written: another cut of the same touches has
    files of the same names."""
    kept = kept_answers(folder)
    files = {cell.key(measure_region): folder / cell.head["file"] for cell in cells}
    changed = {
        key
        for key in files.keys() & kept.keys()
        if not all(_is_held(files[key], row["digest"]) for row in kept[key].rows)
    }
    if changed:
        keep_answers(folder, {key: kept[key] for key in kept if key not in changed})


def _is_held(path: Path, digest: str) -> bool:
    """Whether a file is there with this digest."""
    return path.is_file() and file_digest(path) == digest


def _part(folder: Path, row: Row):
    """The part of a row; OSError where there is none."""
    if row["ended"]:
        raise OSError(
            f"region {row['region']} was not learned: {row['ended']}; regions that were are kept: "
            "call again with larger limits, or with fewer touches a region"
        )
    path = folder / row["file"]
    if not _is_held(path, row["digest"]):
        raise OSError(f"{path} is not what was learned; call the same again")
    return load_part(path)
