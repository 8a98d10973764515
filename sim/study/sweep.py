"""A study of a file: its runs on workers, its tables, its report."""

from collections.abc import Callable
from pathlib import Path

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_lock import locked
from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.course import FIGURES, TIMED, measure_run
from touchatlas.sim.study.study import Study, Watch, run
from touchatlas.sim.study.study_file import StudyFile, with_limits
from touchatlas.sim.study.study_report import Table, write_report
from touchatlas.sim.study.taken_folder import STUDY_FILE, take_study_folder
from touchatlas.sim.study.workers import WorkOptions


def sweep(
    study: StudyFile,
    file: Path,
    folder: Path,
    watch: Watch = lambda done, total: None,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
    force: bool = False,
) -> tuple[list[Row], list[Table]]:
    """Carry out a study into a folder, and write its report.

    Returns the rows and the tables of the report. ValueError for a folder that holds something
    else, unless it is another study that is to be replaced by ``force``.
    """
    make_out_folder(folder)
    cells, runs = study.cells(), runs_of(study)
    with locked(folder):
        text = Path(file).read_bytes()
        keys = {cell.key(runs.measure) for cell in cells}
        take_study_folder(folder, Path(file), keys, force)
        write_whole(folder / STUDY_FILE, text)
        rows = run(runs, cells, folder, watch, with_limits(study, work), say)
        return rows, write_report(study, text.decode(), rows, folder)


def runs_of(study: StudyFile) -> Study:
    """The runs of a study as the engine takes them."""
    columns = ("object", *study.varied, "seed", *FIGURES)
    return Study("runs", columns, measure_run, "ended", {"met": "0"}, TIMED)
