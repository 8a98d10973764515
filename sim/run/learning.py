"""A run that learns from files: scans and answers to plans become an atlas, its surface, and plans.

``touchatlas learn`` and ``touchatlas next`` are this, one call each. The state between two calls is
one file, written whole; the journal holds what was measured, so that a call that is killed loses
nothing.
"""

import io
import json
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import igl
import numpy as np
from threadpoolctl import threadpool_limits

from touchatlas.atlas import (
    Atlas,
    AtlasChange,
    AtlasOptions,
    Scan,
    Surface,
    Touch,
    doubts,
    extract_surface,
    load_atlas,
    save_atlas,
)
from touchatlas.atlas.check.doubt import ended_early
from touchatlas.atlas.files import write_whole
from touchatlas.planner import Planner, PlannerOptions, ProbePlan, load_planner, save_planner
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.option_tables import as_table, updated
from touchatlas.sim.folder.plan_files import plans_csv, plans_json
from touchatlas.sim.folder.ply import ply_bytes, stored
from touchatlas.sim.folder.run_folder import (
    new_run,
    old_run,
    read_settings,
    replace_run,
    write_settings,
)
from touchatlas.sim.folder.run_options import check_number, check_tolerance, fit_scale
from touchatlas.sim.judge.surface_picture import deviation_picture
from touchatlas.sim.run.watcher import Watcher

# The object of run.toml where there is no truth.
RECORDED = "recorded data"
# Keys of run.toml that are no options of the run.
NO_OPTIONS = ("object", "seed", "noise", "scale", "unit", "start", "outward", "versions")
_STATE = "learning.zip"


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


@dataclass(frozen=True, eq=False)
class Learned:
    """What a call came to.

    Parameters
    ----------
    folder : Path
    numbers : dict
        Those of evaluation.json.
    surface : Surface or None
    refused : list of str
        Why scans or touches taught nothing.
    """

    folder: Path
    numbers: dict
    surface: Surface | None
    refused: list[str]


def begin_with_scans(
    out, scans: Sequence[Scan], options: LearnOptions, unit: str, force: bool, watcher: Watcher
) -> Learned:
    """Learn scans into a new run folder.

    Raises
    ------
    ValueError
        When a scan is refused, or the folder holds something. Nothing is written then.
    """
    points = np.concatenate([scan.points for scan in scans])
    noise = float(min(scan.noise_std.min() for scan in scans))
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    tolerance = max(1e-3 * diagonal, noise) if options.tolerance is None else options.tolerance
    check_tolerance(tolerance, diagonal)
    scale = min(fit_scale(noise, diagonal), tolerance)
    start, outward = _side_of(scans[0])
    begun = _Begun(replace(options, tolerance=tolerance), noise, scale, unit, start, outward)
    # A question is put before anything is written.
    run = _Run(*begun.state())
    watcher.begins("learning the points")
    refused = [run.add(scan).refused for scan in scans]
    if any(refused):
        raise ValueError("; ".join(sorted({words for words in refused if words})))
    with new_run(out, force) as folder:
        run.folder = folder
        write_settings(folder, begun.settings())
        with closing(Journal(folder / "journal.sqlite")) as journal:
            for scan in scans:
                journal.append_scan(scan)
        run.learned = len(scans)
        run.save()
        learned = run.written(watcher, [])
        return replace(learned, folder=replace_run(folder))


def begin_with_start(out, start, outward, noise: float, options: LearnOptions) -> None:
    """A new run folder without any data, whose first plan is at a start point.

    Raises
    ------
    ValueError
        When the folder holds something, or there is no tolerance.
    """
    if options.tolerance is None:
        raise ValueError("there is no --tolerance; say how well the surface is wanted")
    check_number("noise", noise, or_zero=True)
    scale = 5.0 * noise or options.tolerance
    begun = _Begun(options, noise, scale, "", list(map(float, start)), list(map(float, outward)))
    run = _Run(*begun.state())
    with new_run(out, force=False) as folder:
        run.folder = folder
        write_settings(folder, begun.settings())
        run.save()


def learn_more(
    path, scans: Sequence[Scan], touches: Sequence[Touch], draw: bool, watcher: Watcher
) -> Learned:
    """Learn more scans and answers to plans into a run folder.

    Raises
    ------
    ValueError
        When a touch answers no plan that is pending, or leaves one before it unanswered; or a scan
        is refused and nothing else was learned.
    """
    with _opened(path) as run:
        _check_answers(run, touches)
        refused = []
        with closing(Journal(run.folder / "journal.sqlite")) as journal:
            for scan in scans:
                watcher.begins("learning the points")
                change = run.add(scan)
                if change.refused:
                    raise ValueError(change.refused)
                journal.append_scan(scan)
                run.learned += 1
            for touch in touches:
                watcher.begins(f"learning the answer to plan {touch.number}")
                journal.append(run.plan(touch.number), touch)
                refused.append(run.add(touch).refused)
                run.learned += 1
                run.save()
        run.save()
        if not draw:
            return Learned(run.folder, {}, None, [words for words in refused if words])
        return run.written(watcher, [words for words in refused if words])


def plans_of(path, count: int) -> tuple[tuple[ProbePlan, ...], str, str]:
    """The pending plans of a run, and new ones up to a count, written to plans.csv and plans.json;
    why there is none, and the unit."""
    with _opened(path) as run:
        plans = run.planner.ask_several(run.atlas, count)
        run.save()
        write_whole(run.folder / "plans.csv", plans_csv(plans))
        write_whole(run.folder / "plans.json", plans_json(plans, run.settings))
        stop = run.planner.stop
        reason = "" if plans or stop is None else stop.reason.value
        return plans, reason, run.settings.get("unit", "")


def pending_plans(path) -> dict[int, ProbePlan]:
    """The plans of a run that are not answered yet, by their numbers."""
    with _opened(path) as run:
        if count := len(run.pending()):
            # Plans of a file say nothing of where arms may end.
            run.planner.ask_several(run.atlas, count)
        return run.pending()


def is_learning(path) -> bool:
    """Whether a folder is a run that learns from files."""
    return (Path(path) / _STATE).is_file()


def unit_and_noise(path) -> tuple[str, float]:
    """The unit of a run, "" where none is named, and the noise of its probe, length."""
    settings = read_settings(path)
    return settings.get("unit", ""), float(settings.get("noise", 0.0))


@dataclass(frozen=True)
class _Begun:
    """How a run begins; ``start`` and ``outward`` are lists of three floats."""

    options: LearnOptions
    noise: float
    scale: float
    unit: str
    start: list[float]
    outward: list[float]

    def settings(self) -> dict[str, Any]:
        """Those of run.toml."""
        own = {"noise": self.noise, "scale": self.scale, "unit": self.unit}
        begun = {"object": RECORDED, "seed": 0, "start": self.start, "outward": self.outward}
        return begun | own | as_table(self.options)

    def state(self) -> tuple[Path, dict, Atlas, Planner]:
        """Folder, settings, and the empty atlas and planner."""
        assert self.options.tolerance is not None
        atlas = Atlas(self.options.tolerance, self.options.atlas, self.scale)
        planner = Planner(self.start, self.outward, self.options.planner)
        return Path(), self.settings(), atlas, planner


def _side_of(scan: Scan) -> tuple[list[float], list[float]]:
    """A point of a scan and a direction from which it may be approached; any where the scan holds
    none."""
    outward = scan.toward[0] if scan.normals is None else scan.normals[0]
    if not outward.any():
        outward = scan.points[0] - scan.points.mean(axis=0)
    length = float(np.linalg.norm(outward))
    outward = outward / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    return scan.points[0].tolist(), outward.tolist()


@dataclass
class _Run:
    """The state of a run; ``learned`` counts what of its journal is in the atlas."""

    folder: Path
    settings: dict[str, Any]
    atlas: Atlas
    planner: Planner
    learned: int = 0

    def add(self, measured: Scan | Touch) -> AtlasChange:
        """Learn one scan, or one answer to a pending plan."""
        change = self.atlas.add(measured)
        if isinstance(measured, Touch):
            self.planner.tell(measured, change)
        return change

    def pending(self) -> dict[int, ProbePlan]:
        """The plans that are not answered, by their numbers."""
        return {plan.number: plan for plan in self.planner.pending}

    def plan(self, number: int) -> ProbePlan:
        """A pending plan."""
        return self.pending()[number]

    def save(self) -> None:
        """Write the state."""
        file = io.BytesIO()
        with TemporaryDirectory() as folder, zipfile.ZipFile(file, "w") as whole:
            atlas, planner = Path(folder) / "atlas.npz", Path(folder) / "planner.json"
            save_atlas(atlas, self.atlas)
            save_planner(planner, self.planner, self.atlas)
            for part in (atlas, planner):
                whole.writestr(zipfile.ZipInfo(part.name), part.read_bytes())
            whole.writestr(zipfile.ZipInfo("learned"), str(self.learned))
        write_whole(self.folder / _STATE, file.getvalue())

    def written(self, watcher: Watcher, refused: list[str]) -> Learned:
        """Write the finished atlas, its surface, doubts and pictures."""
        with TemporaryDirectory() as folder:
            # The exploration goes on from the atlas as it is.
            save_atlas(Path(folder) / "atlas.npz", self.atlas)
            atlas = load_atlas(Path(folder) / "atlas.npz")
        watcher.begins("finishing the atlas")
        atlas.finish()
        save_atlas(self.folder / "atlas.npz", atlas)
        watcher.begins("extracting the surface")
        surface = stored(extract_surface(atlas), atlas.tolerance) if len(atlas) else None
        if surface is not None:
            write_whole(self.folder / "surface.ply", ply_bytes(surface, atlas.tolerance))
            _write_step(self.folder, atlas)
        watcher.begins("drawing the picture")
        if surface is not None and len(surface.faces):
            body = surface.vertices, surface.faces
            picture = deviation_picture(
                "the surface, and how sure it is", body, surface.deviation, atlas.tolerance
            )
            write_whole(self.folder / "surface.png", picture)
        numbers = self._numbers(atlas, surface)
        write_whole(
            self.folder / "evaluation.json", (json.dumps(numbers, indent=2) + "\n").encode()
        )
        return Learned(self.folder, numbers, surface, refused)

    def _numbers(self, atlas: Atlas, surface: Surface | None) -> dict[str, Any]:
        """Numbers of the atlas, without a truth."""
        forecast, stop = self.planner.forecast(atlas), self.planner.stop
        ended = "" if stop is None else stop.reason.value
        share, places = forecast.predicted_coverage, forecast.open_places
        words = "" if stop is None else ended_early(ended, share)
        found = doubts(atlas, surface, places, words)
        body = atlas.body
        numbers = {
            "tolerance": atlas.tolerance,
            "unit": self.settings.get("unit") or "unit of the files",
            "noise_std": float(atlas.pool.noise.min()) if len(atlas.pool) else None,
            "predicted_coverage": share,
            "open_places": places.tolist(),
            "watertight": _is_closed(surface),
            "touches": atlas.touches,
            "points": atlas.point_count,
            "patches": len(atlas),
            "faces": 0 if body is None else len(body.faces),
            "diagonal": atlas.pool.extent,
            "doubts": [doubt.as_dict() for doubt in found],
        }
        return numbers | ({"ended": ended} if ended else {})


def _is_closed(surface: Surface | None) -> bool:
    """Whether a surface has triangles and no rim."""
    if surface is None or not len(surface.faces):
        return False
    return not len(igl.boundary_facets(surface.faces)[0])


def _write_step(folder: Path, atlas: Atlas) -> None:
    """Write surface.step, where the CAD kernel is installed."""
    try:
        from touchatlas.atlas import save_step

        save_step(atlas, folder / "surface.step")
    except (ImportError, ValueError):
        # Without the extra cad, and of a surface without triangles, there is none.
        (folder / "surface.step").unlink(missing_ok=True)


@contextmanager
def _opened(path) -> Iterator[_Run]:
    """The state of a run, with all that its journal holds, locked for others."""
    with old_run(path) as folder, threadpool_limits(1, "blas"):
        if not (folder / _STATE).is_file():
            raise ValueError(
                f"{folder} was explored by simulated touch; give the folder of a run that "
                "touchatlas learn or touchatlas next began"
            )
        settings = read_settings(folder)
        table = {key: value for key, value in settings.items() if key not in NO_OPTIONS}
        updated(LearnOptions(), table, str(folder / "run.toml"))
        with TemporaryDirectory() as held:
            try:
                with zipfile.ZipFile(folder / _STATE) as whole:
                    whole.extractall(held)
                learned = int((Path(held) / "learned").read_text())
            except (zipfile.BadZipFile, KeyError, OSError, ValueError) as error:
                raise ValueError(
                    f"{folder / _STATE} cannot be read ({error}); put another copy there"
                ) from None
            atlas = load_atlas(Path(held) / "atlas.npz")
            planner = load_planner(Path(held) / "planner.json", atlas)
        run = _Run(folder, settings, atlas, planner, learned)
        _replay(run)
        yield run


def _replay(run: _Run) -> None:
    """Learn what the journal holds beyond the state: a call was killed between the two."""
    path = run.folder / "journal.sqlite"
    if not path.exists():
        return
    with closing(Journal(path)) as journal:
        touches, scans = journal.touches(), journal.scans()
    entries: list[Scan | Touch] = []
    for number in range(len(touches) + 1):
        entries += [scan for before, scan in scans if before == number]
        entries += touches[number : number + 1]
    for measured in entries[run.learned :]:
        if isinstance(measured, Touch) and measured.number not in run.pending():
            run.planner.ask_several(run.atlas, 1)
        run.add(measured)
        run.learned += 1


def _check_answers(run: _Run, touches: Sequence[Touch]) -> None:
    """ValueError unless touches answer pending plans, from the first of them on, each once."""
    pending = sorted(run.pending())
    numbers = [touch.number for touch in touches]
    if numbers == pending[: len(numbers)]:
        return
    other = next((n for n in numbers if n not in pending), None)
    if other is not None:
        which = ", ".join(map(str, pending)) or "none"
        raise ValueError(
            f"plan {other} is not pending: {which}; give answers to plans of touchatlas next "
            f"{run.folder}"
        )
    first = next(n for n, m in zip(pending, [*numbers, -1], strict=False) if n != m)
    raise ValueError(
        f"plan {first} is not answered; give its touch as well, or say with the event "
        "unreachable that it was left out"
    )
