"""One process at work on a run: touches, journal, and the end."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from touchatlas.atlas import Atlas, Surface
from touchatlas.atlas.check.free_disc import disc_numbers
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.store import atlas_bytes
from touchatlas.patch.entry_points import PLANNERS, load_added
from touchatlas.patch.words import count_of
from touchatlas.planner import Planner, Step, explore, planner_of
from touchatlas.planner.loop import check_learnable
from touchatlas.planner.options import NAMES
from touchatlas.sim.folder.journal import Entry, Journal
from touchatlas.sim.folder.kept_settings import kept_settings
from touchatlas.sim.folder.recorder import Recorder
from touchatlas.sim.folder.run_folder import replace_run, write_settings
from touchatlas.sim.folder.run_options import RunOptions, fit_scale
from touchatlas.sim.look.frames import Frames
from touchatlas.sim.machine.simulated_probe import probe_of, radius_of_centres
from touchatlas.sim.run.conclusion import Conclusion
from touchatlas.sim.run.interrupt import GRACE, Hold, held_interrupt, interrupt_of
from touchatlas.sim.run.phases import Phases
from touchatlas.sim.run.progress import Progress, read_seconds
from touchatlas.sim.run.watcher import Watcher
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# What to try where the touches of a journal are not those that would be made now.
_OTHER_VERSION = "resume with the versions that run.toml names, or explore again"
_OTHER_TOLERANCE = "explore again to that tolerance, into another folder"
# Why an exploration ended that the planner did not end.
MAX_TOUCHES, MAX_LENGTH, INTERRUPTED = (
    "max_touches reached",
    "max_length reached",
    "interrupted",
)


@dataclass(frozen=True, eq=False)
class Result:
    """The result of a run.

    Parameters
    ----------
    atlas : Atlas
    surface : Surface or None
        None where nothing was touched.
    numbers : dict
        Those of evaluation.json.
    folder : Path
        Where the files are.
    refusal : str
        Why the last touch taught nothing; empty if all did, or met nothing.
    signal : int or None
        What ended the exploration: SIGINT (Ctrl-C) or SIGTERM; None if nothing did.
    """

    atlas: Atlas
    surface: Surface | None
    numbers: dict
    folder: Path
    refusal: str = ""
    signal: int | None = None

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C or SIGTERM ended the exploration."""
        return self.signal is not None


def random_streams(seed: int) -> list[np.random.Generator]:
    """Independent generators of one seed: the probe's noise, the judge, the true progress, and a
    planner that touches at random."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)]


def begin(options: RunOptions, obj, rng: np.random.Generator) -> tuple[Atlas, Planner]:
    """The empty atlas and the planner of a run whose options are complete."""
    assert options.noise is not None and options.tolerance is not None
    start, outward = obj.start()
    # Of a probe that gives centres, plans are for these.
    start = start + radius_of_centres(options.probe, obj) * outward
    scale = fit_scale(options.noise, obj.diagonal)
    atlas = Atlas(options.tolerance, options.atlas, scale)
    # One that knows the object, to compare others with.
    name = options.planner.name
    added: Any = None if name in NAMES else load_added(PLANNERS, name)
    if hasattr(added, "in_simulation"):
        return atlas, added.in_simulation(obj, options.planner, rng)
    return atlas, planner_of(start, outward, options.planner, rng)


@dataclass
class Work:
    """One process at work on a run; ``settings`` are those of its run.toml. The touches ``kept``
    may have been made to a tolerance that is now ``finer``; ``learned`` is the atlas of the last
    one as a file."""

    obj: ImplicitObject | MeshObject
    folder: Path
    options: RunOptions
    settings: dict
    phases: Phases
    watcher: Watcher
    kept: list[Entry] = field(default_factory=list)
    finer: bool = False
    learned: bytes = b""

    def __post_init__(self) -> None:
        options = self.options
        assert options.noise is not None
        probe_rng, self.judge_rng, progress_rng, planner_rng = random_streams(options.seed)
        self.atlas, self.planner = begin(options, self.obj, planner_rng)
        self.probe = probe_of(options, self.obj, probe_rng)
        with self.phases("start", "sampling the truth"):
            # The standard error of the coverage is about 1 %.
            points = self.obj.sample(2000, progress_rng)[0]
        self.progress, self.frames = Progress(self.atlas, points), Frames()
        self.watcher.follows(self.frames, self.obj, self.atlas.tolerance)
        self.old_seconds = read_seconds(self.folder / "steps.csv")[: len(self.kept)]

    def carry_out(self) -> Result:
        """Touch until nothing is left, and write the results."""
        # The systems of equations are small: several threads wait for each other longer than they
        # work, and hundred times longer where the cores are busy.
        with threadpool_limits(1, "blas"):
            with held_interrupt(self._noticed, GRACE) as hold:
                with self._atlas_kept():
                    ended = self._explore(hold)
                if ended == INTERRUPTED:
                    return self._result(ended, hold.signal)
            if hold:
                raise interrupt_of(hold.signal)
            return self._result(ended)

    @contextmanager
    def _atlas_kept(self) -> Iterator[None]:
        """Write the atlas of the last touch that was learned, if the block is cut short: while a
        touch is learned the atlas itself is in pieces. What a probe raises, and what is refused of
        its touches, says how to go on."""
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            if self.learned and len(self.progress.rows) >= len(self.kept):
                with suppress(OSError):
                    write_whole(self.folder / "atlas.npz", self.learned)
                if not isinstance(error, KeyboardInterrupt | OSError):
                    kept = count_of(len(self.progress.rows), "touch is", "touches are")
                    error.add_note(f"{kept} kept, touchatlas resume {self.folder} goes on")
            raise

    def _noticed(self) -> None:
        number = len(self.progress.rows) + 1
        new = f"finishing touch {number}, then writing the results so far"
        self.watcher.interrupted("stopping" if number <= len(self.kept) else new)

    def _result(self, ended: str, signal: int | None = None) -> Result:
        """The results, written; a run that is whole takes the place of the one it replaces."""
        before = sum(map(sum, self.old_seconds))
        conclusion = Conclusion(
            self.obj, self.atlas, self.progress, self.phases, before, self.frames
        )
        known = {"ended": ended, "noise_std": self.options.noise} | self._left()
        known["machine_seconds"] = getattr(self.probe, "seconds", None)
        surface, numbers = conclusion.write(self.folder, self.judge_rng, known)
        folder = self.folder if ended == INTERRUPTED else replace_run(self.folder)
        refusal = (self.progress.refusals or [""])[-1]
        return Result(self.atlas, surface, numbers, folder, refusal, signal)

    def _left(self) -> dict:
        """What the planner predicts of the surface, and where it is not known to the tolerance."""
        forecast, stop = self.planner.forecast(self.atlas), self.planner.stop
        return {
            "predicted_coverage": forecast.predicted_coverage,
            "open_places": forecast.open_places.tolist(),
            "unreachable_places": [] if stop is None else stop.unreachable.tolist(),
            **disc_numbers(self.planner.free_disc(self.atlas)),
            "feature": self.options.planner.feature,
            "region": self.options.planner.region,
        }

    def _explore(self, hold: Hold) -> str:
        """Carry out the touches, each written before it is learned; returns why they ended."""
        options, start, done = self.options, time.perf_counter(), len(self.kept)
        with self._journal() as journal:
            check = partial(check_learnable, self.atlas)
            recorder = Recorder(self.probe, journal, self.kept, self._remedy, check)
            if not done:
                journal.keep_settings(kept_settings(self.settings))
            words = f"repeating {count_of(done, 'touch')} of the journal"
            self.watcher.begins(words if done else "touching")
            steps = explore(
                self.atlas, self.planner, recorder, options.max_touches, options.max_length
            )
            for step in steps:
                self._add(step, recorder)
                if step.plan.number == done - 1:
                    self._repeated(journal)
                self.watcher.touched(step, self.atlas)
                if hold:
                    break
            counted = sum(self.progress.sum(f"seconds_{part}") for part in ("plan", "fit", "sim"))
            counted += self.phases.seconds.get("repeat", 0.0) - sum(map(sum, self.old_seconds))
            if (learned := len(self.progress.rows)) < done:
                # The files of before know more.
                if hold:
                    raise interrupt_of(hold.signal)
                raise ValueError(
                    f"{self.folder} holds {count_of(done, 'touch')}, but exploring now ends "
                    f"after {learned}; {self._remedy}"
                )
            self.progress.measure()
            self.phases.add("record", time.perf_counter() - start - counted)
        return INTERRUPTED if hold else self._why_ended()

    @property
    def _remedy(self) -> str:
        """What to try where the touches of the journal are not those that would be made now."""
        return _OTHER_TOLERANCE if self.finer else _OTHER_VERSION

    def _repeated(self, journal: Journal) -> None:
        """All touches of the journal answer plans of these settings: they are written."""
        write_settings(self.folder, self.settings)
        journal.keep_settings(kept_settings(self.settings))
        self.watcher.begins("touching")

    def _why_ended(self) -> str:
        most, longest = self.options.max_touches, self.options.max_length
        if most is not None and len(self.progress.rows) >= most:
            return MAX_TOUCHES
        if longest is not None and self.progress.last("tracked_length") >= longest:
            return MAX_LENGTH
        assert self.planner.stop is not None
        return self.planner.stop.reason.value

    def _add(self, step: Step, recorder: Recorder) -> None:
        """A row of steps.csv for one touch, with the seconds of the process that made it."""
        number, done = step.plan.number, len(self.kept)
        sim = step.seconds_touch - recorder.take_seconds()
        seconds: tuple[float, ...] = (step.seconds_plan, step.seconds_fit, sim)
        if number < done:
            seconds = (step.seconds_plan, step.seconds_fit, 0.0)
        if number < len(self.old_seconds):
            self.phases.add("repeat", sum(seconds))
            seconds = self.old_seconds[number]
        self.progress.add(step, seconds)
        self.learned = atlas_bytes(self.atlas)
        self.frames.add(step, self.planner, self.atlas, 0.05 * self.obj.diagonal)
        path = self.folder / "steps.csv"
        if number == max(done - 1, 0):
            write_whole(path, self.progress.csv_bytes())
        elif number >= done:
            with open(path, "ab") as file:
                file.write(self.progress.last_row_bytes())

    @contextmanager
    def _journal(self) -> Iterator[Journal]:
        """The journal of the run. steps.csv is written, however the exploration ends."""
        journal, failed = None, True
        try:
            journal = Journal(self.folder / "journal.sqlite")
            yield journal
            failed = False
        except (sqlite3.Error, OSError) as error:
            name = "journal.sqlite" if isinstance(error, sqlite3.Error) else "steps.csv"
            count = count_of(max(len(self.progress.rows), len(self.kept)), "touch")
            raise OSError(
                f"{self.folder / name} cannot be written ({error}) after {count}; all is kept: "
                f"free some space, then touchatlas resume {self.folder}"
            ) from None
        finally:
            if journal is not None:
                journal.close()
            if len(self.progress.rows) >= len(self.kept):
                with suppress(OSError) if failed else nullcontext():
                    write_whole(self.folder / "steps.csv", self.progress.csv_bytes())
