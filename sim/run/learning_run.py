"""The state of a run that learns from files, between two calls.

It is the atlas, the planner, and the journal of what was measured. The journal is written first, so
that a call that is killed loses nothing: what it holds beyond atlas and planner is learned again.
"""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from touchatlas.atlas import (
    Atlas,
    AtlasChange,
    AtlasOptions,
    Scan,
    Touch,
    load_atlas,
    save_atlas,
)
from touchatlas.planner import Planner, PlannerOptions, ProbePlan, load_planner, save_planner
from touchatlas.planner.options import NAMES
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.option_tables import as_table, updated
from touchatlas.sim.folder.run_folder import (
    PLANNER,
    REGIONS_OF,
    is_learning,
    old_run,
    read_settings,
    write_settings,
)
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.look.frame_store import FrameStore

# The object of run.toml where there is no truth.
RECORDED = "recorded data"
# Keys of run.toml that are no options of the run.
NO_OPTIONS = (
    *("object", "seed", "noise", "scale", "unit", "start", "outward"),
    *("versions", REGIONS_OF),
)
_LEARNED = "learned"


@dataclass(frozen=True)
class LearnOptions:
    """Settings of a run that learns from files.

    Parameters
    ----------
    tolerance : float, length, optional
        How well the surface is wanted. By default 1e-3 of the diagonal of the points, or the least
        noise of a file if that is more.
    planner : PlannerOptions
    atlas : AtlasOptions
    """

    tolerance: float | None = None
    planner: PlannerOptions = PlannerOptions()
    atlas: AtlasOptions = AtlasOptions()

    def __post_init__(self) -> None:
        check_number("tolerance", self.tolerance)
        kept = [name for name in NAMES if name != "random"]
        if self.planner.name not in kept:
            raise ValueError(
                f"--planner is {self.planner.name!r}, which no file keeps between two calls; give "
                f"one of {', '.join(kept)}"
            )

    def to(self, tolerance: float) -> "LearnOptions":
        """These options with a tolerance, length."""
        return replace(self, tolerance=tolerance)


@dataclass(frozen=True)
class Begun:
    """How a run begins; ``start`` and ``outward`` are lists of three floats."""

    options: LearnOptions
    noise: float
    scale: float
    unit: str
    start: list[float]
    outward: list[float]

    def run(self) -> "LearningRun":
        """A run that has learned nothing, without a folder."""
        assert self.options.tolerance is not None
        own = {"noise": self.noise, "scale": self.scale, "unit": self.unit}
        begun = {"object": RECORDED, "seed": 0, "start": self.start, "outward": self.outward}
        settings = begun | own | as_table(self.options)
        atlas = Atlas(self.options.tolerance, self.options.atlas, self.scale)
        planner = Planner(self.start, self.outward, self.options.planner)
        return LearningRun(Path(), settings, atlas, planner)


@dataclass
class LearningRun:
    """The state of a run; ``learned`` counts what of its journal is in atlas and planner."""

    folder: Path
    settings: dict[str, Any]
    atlas: Atlas
    planner: Planner
    learned: int = 0

    @property
    def journal(self) -> Path:
        """The file of what was measured."""
        return self.folder / "journal.sqlite"

    @property
    def pending(self) -> dict[int, ProbePlan]:
        """The plans that are not answered, by their numbers."""
        return {plan.number: plan for plan in self.planner.pending}

    @property
    def frames(self) -> FrameStore:
        """What was known at each plan."""
        return FrameStore(self.folder / "frames.sqlite")

    def begin(self, folder: Path) -> None:
        """Take a folder."""
        self.folder = folder
        write_settings(folder, self.settings)

    def add(self, measured: Scan | Touch) -> AtlasChange:
        """Learn one scan, or one answer to a pending plan."""
        change = self.atlas.add(measured)
        if isinstance(measured, Touch):
            self.planner.tell(measured, change)
        self.learned += not change.refused or isinstance(measured, Touch)
        return change

    def ask(self, count: int) -> tuple[ProbePlan, ...]:
        """The pending plans, and new ones up to a count, with what is known when they are made."""
        before = self.pending
        plans = self.planner.ask_several(self.atlas, count)
        with closing(self.frames) as frames:
            for plan in plans:
                if plan.number not in before:
                    apart = 0.05 * self.atlas.pool.extent
                    frames.keep(plan, self.planner.places, self.atlas.body, apart)
        return plans

    def save(self) -> None:
        """Write atlas and planner, then how much of the journal they hold."""
        save_atlas(self.folder / "atlas.npz", self.atlas)
        save_planner(self.folder / PLANNER, self.planner, self.atlas)
        if self.journal.exists():
            with closing(Journal(self.journal)) as journal:
                journal.keep_settings({_LEARNED: self.learned})


def unit_and_noise(path) -> tuple[str, float]:
    """The unit of a run, "" where none is named, and the noise of its probe, length."""
    settings = read_settings(path)
    return settings.get("unit", ""), float(settings.get("noise", 0.0))


@contextmanager
def opened(path) -> Iterator[LearningRun]:
    """The state of a run, with all that its journal holds, locked for others."""
    with old_run(path) as folder, threadpool_limits(1, "blas"):
        if not is_learning(folder):
            raise ValueError(
                f"{folder} was explored by simulated touch; give the folder of a run that "
                "touchatlas learn or touchatlas next began"
            )
        settings = read_settings(folder)
        table = {key: value for key, value in settings.items() if key not in NO_OPTIONS}
        updated(LearnOptions(), table, str(folder / "run.toml"))
        atlas = load_atlas(folder / "atlas.npz", finished=False)
        run = LearningRun(folder, settings, atlas, load_planner(folder / PLANNER, atlas))
        _learn_rest(run)
        yield run


def _learn_rest(run: LearningRun) -> None:
    """Learn what the journal holds beyond atlas and planner: a call was killed before they were
    written, or between the two."""
    if not run.journal.exists():
        return
    with closing(Journal(run.journal)) as journal:
        touches, scans = journal.touches(), journal.scans()
        run.learned = int(journal.settings().get(_LEARNED, 0))
    entries: list[Scan | Touch] = []
    for number in range(len(touches) + 1):
        entries += [scan for before, scan in scans if before == number]
        entries += touches[number : number + 1]
    entered = run.atlas.touches
    for measured in entries[run.learned :]:
        if not isinstance(measured, Touch):
            # A scan that the atlas has already is refused.
            run.atlas.add(measured)
        else:
            if measured.number not in run.pending:
                run.planner.ask_several(run.atlas, 1)
            known = touches.index(measured) < entered
            change = AtlasChange(touch=measured.number) if known else run.atlas.add(measured)
            run.planner.tell(measured, change)
        run.learned += 1
