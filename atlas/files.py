"""Writing files that are complete, or not there."""

import os
from pathlib import Path


def check_path(path, wanted: str = "the path of a file") -> None:
    """ValueError for what names no file.

    >>> check_path(None)
    Traceback (most recent call last):
    ValueError: got NoneType for the path; give the path of a file
    """
    if not isinstance(path, str | os.PathLike):
        raise ValueError(f"got {type(path).__name__} for the path; give {wanted}")


def write_whole(path, data: bytes) -> None:
    """Write a file so that a crash or a full disk leaves either the old one or the new one.

    A write that is interrupted (Ctrl-C) leaves no ``.part`` behind.

    Raises
    ------
    ValueError
        If the path is none.
    OSError
        If it is that of no file, or its folder is not there, or the file cannot be written. Where
        the system says so, ``filename`` is the path.
    """
    check_path(path)
    path = Path(path)
    if path.exists() and not path.is_file():
        raise OSError(f"{path} is a folder or a device; give the path of a file")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent} is no folder; make it, or give another path")
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError as error:
        error.filename = str(path)
        raise
    finally:
        part.unlink(missing_ok=True)
