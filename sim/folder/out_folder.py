"""The folder for results: one that a user names, or one by the options of a run."""

import re
from hashlib import sha256
from pathlib import Path

from touchatlas.sim.folder.option_tables import differences
from touchatlas.sim.folder.run_options import RunOptions

# Options that are a budget, which another run may have in the same folder.
_BUDGET = ("max_touches", "max_length", "seed")


def make_out_folder(path) -> Path:
    """A folder for results, made if it is not there.

    Raises
    ------
    ValueError
        When it is a file, or lies in a file or where no folder can be: another name is needed.
    OSError
        When it cannot be made for another reason, as a full or read-only disk.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; give a folder with --out")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, FileNotFoundError, NotADirectoryError):
        raise ValueError(f"no folder can be made at {path}; choose another --out") from None
    return path


def held_refusal(path, held: str, replaced: str, go_on: str = "") -> ValueError:
    """The error for a folder that holds something, in words: what is found, and what to do.

    Parameters
    ----------
    path : path-like
    held : str
        What it holds of the kind that is to be written; "" where nothing of that kind.
    replaced : str
        What ``--force`` replaces.
    go_on : str
        How to go on with what is held.

    Examples
    --------
    >>> print(held_refusal("runs/a", "a run", "a run"))
    runs/a already holds a run; choose another --out, or --force to replace a run
    """
    found = f"already holds {held}" if held else "is not empty"
    return ValueError(
        f"{path} {found}; choose another --out{go_on}, or --force to replace {replaced}"
    )


def strangers_refusal(path, names: list[str], kind: str) -> ValueError:
    """The error for a folder with files of no such kind that one would overwrite."""
    return ValueError(
        f"{path} holds {', '.join(names)}, of no {kind}, which a {kind} would overwrite; choose "
        "another --out"
    )


def check_out_file(path) -> None:
    """ValueError for a file that cannot be written: a folder, or one in a folder that there is
    not."""
    path = Path(path)
    if path.is_dir():
        raise ValueError(f"{path} is a folder; give a file")
    if not path.parent.is_dir():
        raise ValueError(f"{path.parent} is not a folder; make it, or give another for the file")


def check_new_file(path, flag: str, force: bool) -> None:
    """The same, and for one that is there already, unless it is to be replaced by force; ``flag``
    names it."""
    check_out_file(path)
    if Path(path).exists() and not force:
        raise ValueError(f"{path} is there already; give another {flag}, or --force to replace it")


def default_folder(name: str, options: RunOptions) -> Path:
    """runs/OBJECT-SEED, followed by the options that are not the default: two runs of different
    options have different folders."""
    other = differences(options, RunOptions())
    words = [f"{key}={value}" for key, value in other.items() if key not in _BUDGET]
    text = "-".join([name, str(options.seed), *(re.sub(r"[^\w.=+-]", "_", w) for w in words)])
    # Most file systems take 255 letters, and a terminal some more than a hundred.
    if len(text) > 120:
        text = f"{text[:111]}-{sha256(text.encode()).hexdigest()[:8]}"
    return Path("runs") / text
