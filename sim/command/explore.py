"""touchatlas explore: the command."""

import re
from hashlib import sha256
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import with_options
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.run_end import end_of, resumable
from touchatlas.sim.command.show import shown
from touchatlas.sim.folder.option_tables import differences
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.exploration import NO_OPTIONS, run_exploration
from touchatlas.sim.world.objects import make_object

# Options that are a budget, which another run may have in the same folder.
_BUDGET = ("max_touches", "max_length", "seed")


@with_options(RunOptions(), NO_OPTIONS)
def explore(
    name: Annotated[str, Parameter(name="OBJECT", show_default=False)],
    /,
    *,
    options: RunOptions,
    out: Path | None = None,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    json_: Json = False,
) -> int:
    """Explore an object by simulated touch, build its atlas and judge it.

    A run that was stopped is gone on with by touchatlas resume.

    Parameters
    ----------
    name
        A built-in name (see touchatlas objects) or the path of a mesh file.
    out
        Folder for the run; runs/OBJECT-SEED by default, followed by the options that differ from
        theirs.
    force
        Replace the run that the folder holds, when the new one is whole.
    """
    with shown(f"preparing {name}") as watcher:
        obj = make_object(name, options.seed)
        for sentence in getattr(obj, "notes", ()):
            say(sentence)
        out = default_folder(obj.name, options) if out is None else out
        with resumable(out):
            result = run_exploration(obj, out, options, force, watcher)
    return end_of(result, obj, json_)


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
