"""A run: explore a simulated object, evaluate the atlas, write the run folder; and resume it."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from touchatlas.patch.words import count_of
from touchatlas.planner import StopReason
from touchatlas.sim.folder.journal import Entry, Journal
from touchatlas.sim.folder.kept_settings import NO_OPTIONS, check_settings
from touchatlas.sim.folder.option_tables import as_table, updated
from touchatlas.sim.folder.run_folder import (
    new_run,
    old_run,
    read_settings,
    write_settings,
)
from touchatlas.sim.folder.run_options import (
    RunOptions,
    check_effort,
    check_end,
    check_scale,
)
from touchatlas.sim.machine.fault_words import check_lengths
from touchatlas.sim.machine.options import ARM, check_used, cost_of
from touchatlas.sim.run.learning_run import RECORDED
from touchatlas.sim.run.phases import Phases
from touchatlas.sim.run.progress import read_seconds
from touchatlas.sim.run.watcher import Watcher
from touchatlas.sim.run.work import MAX_LENGTH, MAX_TOUCHES, Result, Work
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.objects import digest_of, make_object
from touchatlas.sim.world.units import millimetre_of

# Journals of earlier versions do not hold the settings of their touches.
_ASSUMED = (
    "the journal of {folder} does not say with which settings it was made; those of run.toml are "
    "taken for them"
)


class FinishedError(ValueError):
    """A run that is to be gone on with is finished; ``numbers`` are those of evaluation.json."""

    def __init__(self, words: str, numbers: dict) -> None:
        super().__init__(words)
        self.numbers = numbers


def run_exploration(
    obj: ImplicitObject | MeshObject,
    out,
    options: RunOptions = RunOptions(),
    force: bool = False,
    watcher: Watcher = Watcher(),
) -> Result:
    """Explore an object, write the run folder, evaluate.

    Parameters
    ----------
    obj : the object; only the probe and the judge see it
    out : path of the run folder
    options : RunOptions
    force : bool
        Replace the run that the folder holds, when the new one is whole.
    watcher : Watcher
        Hears of phases and touches.

    Notes
    -----
    An interrupt (Ctrl-C, SIGTERM) ends the exploration after the current touch. What can be
    written of the results within four seconds is written. A second interrupt ends the run at once.
    Touches already in the journal stay there, whatever happens: ``resume_exploration`` goes on
    with them.
    """
    if not isinstance(obj, ImplicitObject | MeshObject):
        raise ValueError(f"got {obj!r} for the object; give what make_object returns")
    if not isinstance(options, RunOptions):
        raise ValueError(f"options are {options!r}; they must be RunOptions")
    check_used(options.probe)
    phases = Phases(watcher.begins)
    options = completed(options, obj)
    with new_run(out, force) as folder:
        settings = {"object": obj.source, "digest": digest_of(obj), **as_table(options)}
        # What is refused there leaves no run behind.
        work = Work(obj, folder, options, settings, phases, watcher)
        write_settings(folder, settings)
        return work.carry_out()


def resume_exploration(
    path,
    max_touches: int | None = None,
    max_length: float | None = None,
    tolerance: float | None = None,
    watcher: Watcher = Watcher(),
) -> Result:
    """Go on with a run that was stopped in any way, or with a finished one to a larger budget or a
    finer tolerance.

    Planner and atlas learn the touches of the journal again, and the probe goes on as it would
    have. So the atlas is that of the run that was never stopped, byte for byte. Touches to a
    tolerance are the first of those to a finer one, unless the run stagnated; on bodies of lawful
    faces the last ones may be others.

    Parameters
    ----------
    path : path of the run folder
    max_touches, max_length
        The new budget; that of the run where None.
    tolerance : float, length, optional
        A finer tolerance; that of the run where None.
    watcher : Watcher

    Raises
    ------
    FinishedError
        When nothing is left to do.
    ValueError
        When the path holds no run, its object or its options have changed, touches of its journal
        are lost, its budget is smaller than what the journal holds, the tolerance is looser than
        before, or the touches are not the first of those to it. No file has changed then.
    """
    phases = Phases(watcher.begins)
    with old_run(path) as folder:
        settings = read_settings(folder)
        if settings["object"] == RECORDED:
            raise ValueError(
                f"{folder} learns from files; go on with touchatlas next {folder}, and touchatlas "
                f"learn {folder} FILE"
            )
        table = {key: value for key, value in settings.items() if key not in NO_OPTIONS}
        options = updated(RunOptions(), table, str(folder / "run.toml"))
        before = options.tolerance
        new = {"max_touches": max_touches, "max_length": max_length, "tolerance": tolerance}
        options = replace(options, **{k: v for k, v in new.items() if v is not None})
        with phases("start", "reading the journal"):
            kept, held = _kept(folder)
        if held:
            check_settings(folder, settings, held)
        elif kept:
            watcher.assumes(_ASSUMED.format(folder=folder))
        finer = _is_finer(folder, options.tolerance, before)
        _check_budget(folder, options, kept, finer)
        with phases("start", f"preparing {settings['object']}"):
            obj = make_object(settings["object"], options.seed)
        if settings.get("digest") != digest_of(obj):
            raise ValueError(
                f"{settings['object']} has changed since {folder} was begun; explore it again"
            )
        options = completed(options, obj)
        settings = {"object": obj.source, "digest": digest_of(obj), **as_table(options)}
        if not kept:
            write_settings(folder, settings)
        return Work(obj, folder, options, settings, phases, watcher, kept, finer).carry_out()


def _is_finer(folder: Path, tolerance: float | None, before: float | None) -> bool:
    """Whether a tolerance is finer than that of the run; ValueError where it is looser."""
    if before is None or tolerance is None or tolerance == before:
        return False
    if not tolerance < before:
        raise ValueError(
            f"tolerance is {tolerance:g}, looser than the {before:g} of {folder}, which has "
            f"touches that it does not need; give one below {before:g}, or explore again into "
            "another folder"
        )
    return True


def completed(options: RunOptions, obj) -> RunOptions:
    """Options with the object's own noise and tolerance where they are left out, checked."""
    usual = obj.noise_std if options.probe.machine == ARM else 0.1 * obj.noise_std
    noise = float(usual if options.noise is None else options.noise)
    tolerance = float(obj.tolerance if options.tolerance is None else options.tolerance)
    check_scale(noise, tolerance, obj.diagonal)
    check_lengths(options.fault, tolerance, obj.diagonal)
    check_end(options, noise, tolerance, obj.diagonal)
    check_effort(options.planner)
    unit = _unit(options, obj)
    if not options.planner.cost.rapid:
        cost = cost_of(options.probe, millimetre_of(unit or "", obj.diagonal))
        options = replace(options, planner=replace(options.planner, cost=cost))
    return replace(options, noise=noise, tolerance=tolerance, unit=unit)


def _unit(options: RunOptions, obj) -> str | None:
    """The unit of an object: what its file names, or what the user says; None where none does."""
    own = "mm" if isinstance(obj, ImplicitObject) else obj.unit
    if own and options.unit not in (None, own):
        raise ValueError(
            f"unit is {options.unit}, but {obj.name} is in {own}; give all lengths in {own}, and "
            "leave --unit out"
        )
    if not own:
        obj.unit = options.unit or ""
    return options.unit or own or None


def _kept(folder: Path) -> tuple[list[Entry], dict]:
    """What the journal of a run holds, and the settings of its touches; nothing where it was not
    begun.

    Raises
    ------
    ValueError
        When it is damaged, or holds fewer touches than steps.csv, which is written after it.
    """
    path, kept, held = folder / "journal.sqlite", [], {}
    # An empty file would be written to.
    if path.exists() and path.stat().st_size:
        try:
            with closing(Journal(path)) as journal:
                kept = journal.entries()
                held = journal.settings() if kept else {}
        except sqlite3.Error as error:
            raise OSError(
                f"{path} cannot be read ({error}); see that there is space, and that no other "
                "program has it open"
            ) from None
    if (learned := len(read_seconds(folder / "steps.csv"))) > len(kept):
        raise ValueError(
            f"{path} holds {count_of(len(kept), 'touch')}, but steps.csv {learned}; put the "
            "whole journal back, or explore again with --force"
        )
    return kept, held


def _check_budget(folder: Path, options: RunOptions, kept: list[Entry], finer: bool) -> None:
    """FinishedError for a run in which nothing is left to do; ValueError for a budget that is
    less than what was touched. A run whose tolerance is now finer was not finished by its planner.
    """
    touches, length = len(kept), sum(entry.touch.tracked_length for entry in kept)
    before = sum(entry.touch.tracked_length for entry in kept[:-1])
    most, longest = options.max_touches, options.max_length
    if most is not None and touches > most:
        raise ValueError(f"max-touches is {most}, but {folder} holds {touches}; give a larger one")
    if longest is not None and before >= longest:
        raise ValueError(
            f"max-length is {longest:g}, but {folder} holds {length:.4g}; give a larger one"
        )
    try:
        numbers = json.loads((folder / "evaluation.json").read_text(encoding="utf-8"))
        ended = numbers["ended"] if numbers["touches"] == touches else None
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return
    if ended in {reason.value for reason in StopReason} and not finer:
        raise FinishedError(f"{folder} is finished: {ended}", numbers)
    if ended == MAX_TOUCHES and touches == most:
        words = count_of(most, "touch")
        words = f"{folder} is finished: it has its {words}; give a larger --max-touches"
        raise FinishedError(words, numbers)
    if ended == MAX_LENGTH and longest is not None and length >= longest:
        words = f"{folder} is finished: it has tracked {length:.4g}; give a larger --max-length"
        raise FinishedError(words, numbers)
