"""The folder of a run: its files, and its settings, run.toml."""

import json
import math
import os
import platform
import tempfile
import tomllib
from importlib.metadata import version
from pathlib import Path

from touchatlas.atlas.files import write_whole

RUN_FILES = (
    "run.toml",
    "journal.sqlite",
    "atlas.npz",
    "surface.ply",
    "steps.csv",
    "evaluation.json",
    "progress.png",
)
# Files that a killed run may leave beside them. SQLite would replay an old journal.sqlite-journal
# into a new journal.
_LEFTOVERS = ("journal.sqlite-journal", *(f"{name}.part" for name in RUN_FILES))
_PACKAGES = ("touchatlas", "numpy", "scipy", "networkx", "trimesh", "libigl")


def create_folder(path, force: bool) -> Path:
    """The run folder, made or taken over; only the files of a run are ever removed.

    Raises
    ------
    ValueError
        When it holds something and ``force`` is not set, or holds files of the same names that
        are no run's.
    OSError
        When it cannot be made or written.
    """
    path = Path(path)
    if os.path.lexists(path) and not path.is_dir():
        raise ValueError(f"{path} is a file or a broken link; give a folder with --out")
    is_run = _is_run(path)
    if path.is_dir() and any(path.iterdir()):
        if not force:
            what = "already holds a run" if is_run else "is not empty"
            raise ValueError(f"{path} {what}; choose another --out, or --force to replace a run")
        ours = Path.is_file if is_run else lambda _: False
        others = [n for n in RUN_FILES if (path / n).exists() and not ours(path / n)]
        if others:
            raise ValueError(
                f"{path} holds {', '.join(others)}, of no run, which a run would overwrite; "
                "choose another --out"
            )
    path.mkdir(parents=True, exist_ok=True)
    _try_to_write(path)
    # run.toml goes last: while it is there, what else is left is known to be a run's.
    for name in (*_LEFTOVERS, *reversed(RUN_FILES)) if is_run else ():
        (path / name).unlink(missing_ok=True)
    return path


def _is_run(path: Path) -> bool:
    """Whether the folder has a run.toml that we wrote."""
    try:
        settings = tomllib.loads((path / "run.toml").read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, ValueError):
        return False
    versions = settings.get("versions")
    return isinstance(versions, dict) and "touchatlas" in versions


def _try_to_write(path: Path) -> None:
    """OSError that names the folder, if the files of a run cannot be written to it."""
    try:
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def write_settings(folder: Path, settings: dict) -> None:
    """Write run.toml: the settings of a run, and the versions that make it."""
    versions = {"python": platform.python_version()} | {p: version(p) for p in _PACKAGES}
    write_whole(folder / "run.toml", _toml({**settings, "versions": versions}).encode())


def read_settings(folder) -> dict:
    """run.toml of a finished run.

    Raises
    ------
    ValueError
        When the folder holds none, or no surface.ply, or the settings no object, tolerance, seed.
    """
    path = Path(folder) / "run.toml"
    if not path.is_file():
        raise ValueError(f"{folder} is not the folder of a run; run explore first")
    if not path.with_name("surface.ply").is_file():
        raise ValueError(f"{folder} holds a run without a surface.ply; let explore finish one")
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
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
