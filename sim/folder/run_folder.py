"""The folder of a run: who may write to it, how a run replaces another, its settings, run.toml."""

import json
import math
import os
import platform
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import (
    held_refusal,
    make_out_folder,
    strangers_refusal,
)
from touchatlas.sim.folder.run_lock import LOCK, check_free, locked

RUN_FILES = (
    "run.toml",
    "journal.sqlite",
    "atlas.npz",
    "surface.ply",
    "steps.csv",
    "evaluation.json",
    "progress.png",
    "surface.png",
    "replay.html",
)
# What a run that learns from files has besides.
PLANNER = "planner.json"
LEARNING_FILES = PLANNER, "frames.sqlite", "surface.step", "plans.csv", "plans.json"
_FILES = *RUN_FILES, *LEARNING_FILES
# Where a run is made that is to replace another, and its name when it is whole. Names of files that
# the whole one lacks are marked there, so that replacing can be done again after a crash.
REPLACEMENT, _WHOLE, _ABSENT = "replacement", "replacement.whole", ".absent"
# Files that a killed run may leave beside them. SQLite would replay an old journal.sqlite-journal
# into a new journal.
_LEFTOVERS = (
    "journal.sqlite-journal",
    "frames.sqlite-journal",
    *(f"{name}.part" for name in _FILES),
)
# In the run.toml of an atlas that was joined from regions: the run with its touches, as a path from
# the folder, so that both may be moved together.
REGIONS_OF = "regions_of"
_PACKAGES = ("touchatlas", "numpy", "scipy", "networkx", "trimesh", "libigl")


@contextmanager
def new_run(path, force: bool) -> Iterator[Path]:
    """The folder for a new run, made or taken over, and locked for others.

    Where it holds a run and ``force`` is set, what is yielded is a folder ``replacement`` within
    it; ``replace_run`` then puts the new run in the place of the old one. Only the files of a run
    are ever removed.

    Raises
    ------
    ValueError
        When it holds something and ``force`` is not set, or holds files of the same names that
        are no run's, or another process is at work there.
    OSError
        When it cannot be made or written.
    """
    path = Path(path)
    _check_new(path, force)
    make_out_folder(path)
    _try_to_write(path)
    with locked(path):
        # Another process may have been here since.
        _check_new(path, force)
        _finish_replacing(path)
        if not is_run(path):
            yield path
            return
        target = path / REPLACEMENT
        target.mkdir(exist_ok=True)
        _remove_run(target)
        yield target


@contextmanager
def old_run(path) -> Iterator[Path]:
    """The folder of a run that is gone on with, locked for others: the one that was to replace
    another, where it was not finished.

    Raises
    ------
    ValueError
        When it holds no run, or another process is at work there.
    """
    path = Path(path)
    if path.name == REPLACEMENT and is_run(path.parent):
        path = path.parent
    if not is_run(path) and not (path / _WHOLE).is_dir():
        check_explored(path, own_settings(path))
        raise ValueError(
            f"{path} holds no run (a run.toml of ours); give the folder of one, or run explore"
        )
    _try_to_write(path)
    with locked(path):
        _finish_replacing(path)
        yield path / REPLACEMENT if is_run(path / REPLACEMENT) else path


def replace_run(folder: Path) -> Path:
    """Put a whole run in the place of the one that it replaces; returns its folder then.

    A crash within is made good by the next one who takes the folder.
    """
    if folder.name != REPLACEMENT or not is_run(folder.parent):
        return folder
    for name in _FILES:
        if not (folder / name).exists():
            (folder / f"{name}{_ABSENT}").touch()
    folder.rename(folder.parent / _WHOLE)
    _finish_replacing(folder.parent)
    return folder.parent


def _finish_replacing(path: Path) -> None:
    """Move the files of a whole replacement to their place; nothing where there is none."""
    whole = path / _WHOLE
    if not whole.is_dir():
        return
    for name in _LEFTOVERS:
        (path / name).unlink(missing_ok=True)
    for name in reversed(_FILES):
        if (whole / name).exists():
            os.replace(whole / name, path / name)
        elif (mark := whole / f"{name}{_ABSENT}").exists():
            (path / name).unlink(missing_ok=True)
            mark.unlink()
    # The user may have put something there.
    with suppress(OSError):
        whole.rmdir()


def _check_new(path: Path, force: bool) -> None:
    """ValueError unless a run may be written to the path."""
    if os.path.lexists(path) and not path.is_dir():
        raise ValueError(f"{path} is a file or a broken link; give a folder with --out")
    if not path.is_dir() or is_empty(path):
        return
    held = is_run(path)
    if not force:
        check_free(path)
        command = "next" if is_learning(path) else "resume"
        go_on = f", touchatlas {command} {path} to go on with it" if held else ""
        raise held_refusal(path, "a run" if held else "", "a run", go_on)
    ours = Path.is_file if held else lambda _: False
    others = [n for n in _FILES if (path / n).exists() and not ours(path / n)]
    inner = path / REPLACEMENT
    if os.path.lexists(inner) and not (held and _is_replacement(inner)):
        others.append(REPLACEMENT)
    if others:
        raise strangers_refusal(path, others, "run")


def _is_replacement(path: Path) -> bool:
    """Whether a folder is a run that was to replace another, or was killed before it began."""
    return path.is_dir() and not path.is_symlink() and (is_run(path) or is_empty(path))


def is_empty(path: Path) -> bool:
    """Whether a folder holds nothing but what a process killed at its first step leaves."""
    return all(file.name in (LOCK, *_LEFTOVERS) for file in path.iterdir())


def _remove_run(path: Path) -> None:
    """Remove the files of a run."""
    # run.toml goes last: while it is there, what else is left is known to be a run's.
    for name in (*_LEFTOVERS, *reversed(_FILES)):
        (path / name).unlink(missing_ok=True)


def is_run(path: Path) -> bool:
    """Whether the folder has a run.toml that we wrote, and touches of its own."""
    settings = own_settings(path)
    return bool(settings) and REGIONS_OF not in settings


def is_learning(path) -> bool:
    """Whether a folder is a run that learns from files."""
    return (Path(path) / PLANNER).is_file()


def going_on(folder) -> str:
    """How a run that was stopped is gone on with, in words."""
    if is_learning(folder):
        return f"touchatlas learn {folder} FILE teaches it more"
    return f"touchatlas resume {folder} goes on with one that was stopped"


def check_beside_runs(path) -> None:
    """ValueError for a file that a run folder holds by that name: it would be lost."""
    path = Path(path)
    folder = path.resolve().parent
    names = {*_FILES, *_LEFTOVERS, REPLACEMENT, _WHOLE, LOCK}
    if path.name.lower() in names and (own_settings(folder) or (folder / "atlas.npz").is_file()):
        raise ValueError(
            f"{path} is a file of the run itself; give another name, or another folder"
        )


def own_settings(path: Path) -> dict:
    """run.toml of a folder; empty where we did not write it."""
    try:
        settings = tomllib.loads((path / "run.toml").read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, ValueError, RecursionError):
        return {}
    versions = settings.get("versions")
    return settings if isinstance(versions, dict) and "touchatlas" in versions else {}


def _try_to_write(path: Path) -> None:
    """OSError that names the folder, if the files of a run cannot be written to it."""
    try:
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def versions() -> dict[str, str]:
    """The versions that make a run."""
    return {"python": platform.python_version()} | {p: version(p) for p in _PACKAGES}


def changed_versions(settings: dict) -> str:
    """The versions that made a run and are others now, in words; empty if all are the same."""
    then, now = settings.get("versions"), versions()
    if not isinstance(then, dict):
        return ""
    changed = [name for name in now if name in then and then[name] != now[name]]
    return ", ".join(f"{name} {then[name]} (now {now[name]})" for name in changed)


def write_settings(folder: Path, settings: dict) -> None:
    """Write run.toml: the settings of a run, and the versions that make it."""
    write_whole(folder / "run.toml", _toml({**settings, "versions": versions()}).encode())


def read_settings(folder) -> dict:
    """run.toml of a run.

    Raises
    ------
    ValueError
        When the folder holds none, or the settings no object, tolerance, seed.
    """
    path = Path(folder) / "run.toml"
    if not path.is_file():
        raise ValueError(f"{folder} is not the folder of a run; run explore first")
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} cannot be read ({error}); explore again") from None
    proper = {
        "object": lambda value: isinstance(value, str),
        "tolerance": lambda value: isinstance(value, float) and 0.0 < value < math.inf,
        "seed": lambda value: type(value) is int and value >= 0,
    }
    wrong = [name for name, is_proper in proper.items() if not is_proper(settings.get(name))]
    if wrong:
        raise ValueError(f"{path} lacks a proper {' and '.join(wrong)}; explore again")
    return settings


def run_of_regions(folder, settings: dict) -> str | None:
    """The run whose regions a folder holds; None of another folder."""
    held = settings.get(REGIONS_OF)
    return os.path.normpath(Path(folder) / held) if isinstance(held, str) else None


def check_explored(folder, settings: dict) -> None:
    """ValueError for a folder that is no run, but an atlas that was joined from regions of one."""
    if run := run_of_regions(folder, settings):
        own = "" if Path(folder) == Path(run) / "regions" else f" --out {folder}"
        raise ValueError(
            f"{folder} is for the regions of {run}, and has no touches: touchatlas regions {run}"
            f"{own} learns them, touchatlas resume {run} goes on with the run"
        )


def read_finished(folder) -> dict:
    """run.toml of a run that has a surface; ValueError where it has none."""
    settings = read_settings(folder)
    if not (Path(folder) / "surface.ply").is_file():
        check_explored(folder, settings)
        raise ValueError(f"{folder} holds a run without a surface.ply; {going_on(folder)}")
    return settings


def _toml(table: dict, name: str = "") -> str:
    """A dictionary of numbers, strings and dictionaries as TOML; None is left out."""
    lines, inner = [], []
    for key, value in table.items():
        if isinstance(value, dict):
            path = f"{name}.{key}" if name else key
            inner.append(f"\n[{path}]\n{_toml(value, path)}")
        elif value is not None:
            # TOML writes values as JSON does, except surrogate pairs and infinite numbers.
            word = json.dumps(value, ensure_ascii=False, default=lambda number: number.item())
            word = repr(float(value)) if isinstance(value, float) else word
            lines.append(f"{key} = {word}\n")
    return "".join(lines + inner)
