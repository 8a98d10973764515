"""touchatlas resume: the command."""

from pathlib import Path

from touchatlas.sim.command.numbers import All, Json, print_numbers
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.outcome import say
from touchatlas.sim.folder.run_folder import changed_versions, check_explored, read_settings


def resume(
    run: Path,
    /,
    *,
    max_touches: Whole | None = None,
    max_length: float | None = None,
    tolerance: float | None = None,
    all_: All = False,
    json_: Json = False,
) -> int:
    """Go on with a stopped run, or with a finished one to more touches or a finer tolerance.

    It works after Ctrl-C, kill, a full disk and a crash. The touches of the journal are learned
    again, and the atlas is that of the run that was never stopped, byte for byte. To a finer
    tolerance it is that of a run which had this tolerance from the beginning.

    Parameters
    ----------
    run
        The folder of a run.
    max_touches
        Stop after this many touches, those of before included; the run's own by default.
    max_length
        Stop after this much tracked length, in the file's unit (mm for built-in objects), that of
        before included; the run's own by default.
    tolerance
        How well the surface is wanted, in the file's unit (mm for built-in objects), and no looser
        than before; the run's own by default.
    """
    from touchatlas.sim.command.run_end import end_of, resumable
    from touchatlas.sim.command.show import shown
    from touchatlas.sim.run.exploration import FinishedError, resume_exploration
    from touchatlas.sim.world.objects import make_object

    settings = read_settings(run)
    check_explored(run, settings)
    if changed := changed_versions(settings):
        say(f"{run} was begun with {changed}; the last digits may differ")
    try:
        with shown(f"resuming {run}") as watcher, resumable(run):
            result = resume_exploration(run, max_touches, max_length, tolerance, watcher)
    except FinishedError as finished:
        print_numbers(finished.numbers, f"{settings['object']}: {run}", json_, all_)
        say(str(finished))
        return 0
    return end_of(result, make_object(settings["object"], settings["seed"]), json_, all_)
