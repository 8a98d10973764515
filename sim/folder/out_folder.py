"""The folder that a user names for results."""

from pathlib import Path


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
