"""What is printed at the end of a run, and its exit code."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from touchatlas.patch.words import count_of
from touchatlas.sim.command.numbers import print_numbers
from touchatlas.sim.command.outcome import ExitCode, complain, say
from touchatlas.sim.folder.run_folder import is_run, read_settings
from touchatlas.sim.machine.fault_words import never_began
from touchatlas.sim.run.work import Result

_UNSURE = (
    "nowhere is the surface known to within the tolerance; give a larger --tolerance, less --noise "
    "or more touches"
)
# Where nothing can be written, nothing was begun.
_NOT_OURS = (errno.EROFS, errno.EACCES, errno.EPERM)


@contextmanager
def resumable(folder) -> Iterator[None]:
    """Let what stops the block say how to go on."""
    try:
        yield
    except OSError as error:
        if error.errno not in _NOT_OURS and is_run(Path(folder)) and "resume" not in str(error):
            error.add_note(f"touchatlas resume {folder} goes on")
        raise
    except KeyboardInterrupt as stop:
        stop.add_note(f"touches in the journal are kept, and touchatlas resume {folder} goes on")
        raise


def end_of(result: Result, obj, as_json: bool, every: bool = False) -> int:
    """Print the numbers of a run and what they say; returns the exit code."""
    numbers, folder = result.numbers, result.folder
    print_numbers(numbers, f"{obj.name}: {folder}", as_json, every)
    if result.signal is not None:
        kept = f"stopped after {count_of(numbers['touches'], 'touch')}; all is kept"
        return complain(f"{kept}, touchatlas resume {folder} goes on", 128 + result.signal)
    held = count_of(numbers["touches"], "touch")
    if late := never_began(read_settings(folder).get("fault", ""), numbers["touches"]):
        say(f"--fault {late} never began: the run has {held}, numbered from 0")
    if result.surface is None:
        return complain(no_surface(result), ExitCode.FAILURE)
    return 0 if len(result.surface.faces) else complain(_UNSURE, ExitCode.FAILURE)


def no_surface(result: Result) -> str:
    """Why there is no surface."""
    touches, missed = result.numbers["touches"], result.numbers["touches_without_contact"]
    if missed == touches:
        return (
            f"none of {count_of(touches, 'touch')} met the object, so there is no surface; "
            "a probe from above does not meet it: turn the object"
        )
    return (
        f"no touch taught anything, so there is no surface ({result.refusal}); give less --noise "
        "or a larger --tolerance, or turn the object"
    )
