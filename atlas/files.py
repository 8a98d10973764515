"""Files: they are written whole or not at all, and given back whole or refused in one sentence."""

import os
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

_Read = TypeVar("_Read")
_Made = TypeVar("_Made")
# Errors that reading a damaged file raises. Their messages are words of libraries, for programmers.
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    ArithmeticError,
    AttributeError,
    ValueError,
    LookupError,
    TypeError,
    RuntimeError,
    SyntaxError,
    tokenize.TokenError,
    EOFError,
    OSError,
)


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


class DamagedError(ValueError):
    """What a file holds is not what was written; the message says in plain words how."""


@dataclass(frozen=True)
class FileKind:
    """A kind of file, as messages name it.

    Parameters
    ----------
    name : str
        What the file holds.
    wanted : str
        What to give where there is no such file.
    number : int
        Version of the format; a file of another version is refused.
    instead : str
        What to do without the file.
    """

    name: str
    wanted: str
    number: int
    instead: str


def load_whole(
    path, kind: FileKind, read: Callable[[bytes], tuple[Any, _Read]], make: Callable[[_Read], _Made]
) -> _Made:
    """What a file holds.

    Parameters
    ----------
    path : path of the file
    kind : FileKind
    read : function from bytes to the number of the format and the content
    make : function from the content to what is returned, for a file of this format

    Raises
    ------
    ValueError
        When the path is none, or the file is missing, unreadable, cut off, altered, or of another
        format.
    """
    check_path(path, kind.wanted)
    if not Path(path).is_file():
        found = "is a folder or device" if Path(path).exists() else "does not exist"
        raise ValueError(f"{path} {found}; give {kind.wanted}")
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read ({error.strerror}); give {kind.wanted}") from None
    try:
        number, content = read(data)
        if type(number) is not int:
            raise DamagedError("it has no number of a format")
        if number == kind.number:
            return make(content)
    except _DAMAGE as error:
        how = f" ({error})" if isinstance(error, DamagedError) else ""
        raise ValueError(
            f"{path} is no whole {kind.name} file{how}; it was cut off or altered: give another "
            "copy"
        ) from None
    raise ValueError(
        f"{path} has format {number}; this version reads {kind.number}: use the version that "
        f"wrote it, or {kind.instead}"
    )
