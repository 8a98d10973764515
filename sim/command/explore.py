"""touchatlas explore: the command."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from touchatlas.sim.command.numbers import All, Json
from touchatlas.sim.command.option_flags import with_options
from touchatlas.sim.command.outcome import say
from touchatlas.sim.folder.kept_settings import NO_OPTIONS
from touchatlas.sim.folder.out_folder import default_folder
from touchatlas.sim.folder.run_options import RunOptions


@with_options(RunOptions(), NO_OPTIONS)
def explore(
    name: Annotated[str, Parameter(name="OBJECT", show_default=False)],
    /,
    *,
    options: RunOptions,
    out: Path | None = None,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    view: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    all_: All = False,
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
    view
        Show the run in a browser while it goes on, and its replay at the end.
    """
    from touchatlas.sim.command.run_end import end_of, resumable
    from touchatlas.sim.command.show import shown
    from touchatlas.sim.command.view import show_page
    from touchatlas.sim.run.exploration import run_exploration
    from touchatlas.sim.world.objects import make_object

    with shown(f"preparing {name}") as watcher:
        watcher.is_viewed = view
        obj = make_object(name, options.seed)
        for sentence in getattr(obj, "notes", ()):
            say(sentence)
        out = default_folder(obj.name, options) if out is None else out
        with resumable(out):
            result = run_exploration(obj, out, options, force, watcher)
    if view:
        show_page(result.folder)
    return end_of(result, obj, json_, all_)
