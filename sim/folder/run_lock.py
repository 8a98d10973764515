"""One process at a time writes to a run folder."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # No flock on this system (Windows): folders are not locked there.
    fcntl = None  # type: ignore[assignment]

LOCK = "run.lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a run folder; it goes with the process, however that ends.

    The file run.lock is locked by flock(2) and holds the number of the process. It is removed at
    the end; one that a killed process leaves behind is locked by nobody.

    Raises
    ------
    ValueError
        When another process holds the lock; it names the number of that process.
    OSError
        When the folder cannot be written.
    """
    path = folder / LOCK
    file = _lock(path)
    try:
        file.seek(0)
        file.truncate()
        file.write(f"{os.getpid()}\n")
        file.flush()
        yield
    finally:
        # While it is still locked: nobody else can hold it then.
        with suppress(OSError):
            path.unlink()
        file.close()


def check_free(folder: Path) -> None:
    """ValueError, with the number of the process, where another one holds the lock."""
    if fcntl is None:
        return
    with suppress(OSError), (folder / LOCK).open() as file:
        try:
            # Shared, so that two who only look do not refuse each other.
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _at_work(folder, file) from None


def _lock(path: Path) -> IO[str]:
    """The lock file, opened and locked."""
    while True:
        file = path.open("a+")  # noqa: SIM115 - it stays open
        try:
            if fcntl is None:
                return file
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The holder before may have removed the file after it was opened here.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                    return file
        except BlockingIOError:
            refusal = _at_work(path.parent, file)
            file.close()
            raise refusal from None
        except BaseException:
            file.close()
            raise
        file.close()


def _at_work(folder: Path, file: IO[str]) -> ValueError:
    """The error for a folder that another process holds."""
    return ValueError(
        f"process {_holder(file)} is at work in {folder}; wait for it, stop it, or choose "
        "another --out"
    )


def _holder(file: IO[str]) -> str:
    """The number in a lock file, for which the holder may need a moment."""
    for _ in range(20):
        file.seek(0)
        if number := file.read(20).strip():
            return number
        time.sleep(0.01)
    return "of unknown number"
