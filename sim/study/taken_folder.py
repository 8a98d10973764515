"""The folder of a study or of regions: gone on with by the same, replaced by another by force."""

from collections.abc import Iterable
from pathlib import Path

from touchatlas.patch.words import count_of
from touchatlas.sim.folder.out_folder import held_refusal, strangers_refusal
from touchatlas.sim.folder.run_folder import is_empty
from touchatlas.sim.study.cells import LEDGER, keep_answers, kept_answers

STUDY_FILE = "study.toml"
# What a study makes of its ledger.
_WRITTEN = (
    *("runs.csv", "runs.parquet", "times.csv"),
    *("report.html", "report.pdf", "summary.json"),
)


def check_replaced(path: Path, kind: str, held: str, files: tuple[str, ...], force: bool) -> None:
    """Whether what a folder holds may be replaced.

    Parameters
    ----------
    path : Path
        That is there.
    kind : str
        What is to be written, as "study".
    held : str
        What the folder holds of that kind, in words; "" where nothing.
    files : tuple of str
        Names of the files of the kind.
    force : bool

    Raises
    ------
    ValueError
        When it holds something and ``force`` is not set, or files of these names of no such kind.
    """
    if is_empty(path):
        return
    if not force:
        raise held_refusal(path, held, f"a {kind}")
    strangers = [] if held else [name for name in files if (path / name).exists()]
    if strangers:
        raise strangers_refusal(path, strangers, kind)


def remove_files(path: Path, names: Iterable[str]) -> None:
    """Remove files of a folder, where they are there."""
    for name in names:
        (path / name).unlink(missing_ok=True)


def take_study_folder(path: Path, file: Path, keys: set[str], force: bool) -> None:
    """Let a study be written to a folder: it goes on where all answers that are kept there are of
    its cells, and keeps those that are where it replaces another by force.

    Parameters
    ----------
    path, file : Path
        The folder, and the file of the study.
    keys : set of str
        Of its cells.
    force : bool
    """
    is_study = (path / LEDGER).is_file() and (path / STUDY_FILE).is_file()
    answers = kept_answers(path) if is_study else {}
    lost = len(answers.keys() - keys)
    if is_study and not lost:
        return
    if not is_study and _is_source(path, file):
        return
    held = f"a study with {count_of(lost, 'run')} that {file} has not" if is_study else ""
    check_replaced(path, "study", held, (STUDY_FILE, *_WRITTEN, LEDGER), force)
    if is_study:
        remove_files(path, _WRITTEN)
        keep_answers(path, {key: answers[key] for key in answers if key in keys})


def _is_source(path: Path, file: Path) -> bool:
    """Whether a folder has nothing of a study but, maybe, the file that says what it is."""
    held = [name for name in (STUDY_FILE, *_WRITTEN, LEDGER) if (path / name).exists()]
    return held == [STUDY_FILE] and (path / STUDY_FILE).samefile(file)
