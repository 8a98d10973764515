"""Reading a file of this library: it is given back whole, or refused in one sentence."""

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
# Letters of a message or of a file that are passed on. Doubled, sentences are pages.
_LONGEST = 200
# Errors that reading a damaged file raises.
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

    def check_path(self, path) -> None:
        """ValueError for what names no file."""
        if not isinstance(path, str | os.PathLike):
            raise ValueError(f"got {type(path).__name__} for the path; give {self.wanted}")


def load_whole(
    path,
    kind: FileKind,
    read: Callable[[bytes], tuple[Any, _Read]],
    make: Callable[[_Read], _Made],
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
        When the path is none, or the file is missing, cut off, altered, or of another format.
    """
    kind.check_path(path)
    if not Path(path).is_file():
        found = "is a folder or device" if Path(path).exists() else "does not exist"
        raise ValueError(f"{path} {found}; give {kind.wanted}")
    try:
        number, content = read(Path(path).read_bytes())
        if number == kind.number:
            return make(content)
    except _DAMAGE as error:
        # A message of zipfile or numpy may hold pages of the file.
        words = " ".join(str(error).split())[:_LONGEST]
        raise ValueError(
            f"{path} is no whole {kind.name} file ({words}); it was cut off or altered: give "
            "another copy"
        ) from None
    raise ValueError(
        f"{path} has format {str(number)[:_LONGEST]}; this version reads {kind.number}: use the "
        f"version that wrote it, or {kind.instead}"
    )
