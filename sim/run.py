"""The run folder: explore a simulated object, judge it, and keep everything."""

import csv
import io
import json
import platform
import signal
import sqlite3
import tempfile
import threading
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.store import save_atlas, write_whole
from touchatlas.atlas.surface import Surface, extract_surface
from touchatlas.planner.explore import Step, explore
from touchatlas.planner.planner import Planner
from touchatlas.sim.evaluate import EvaluateOptions, Evaluation, Truth, evaluate_surface
from touchatlas.sim.implicit import ImplicitObject
from touchatlas.sim.journal import Journal
from touchatlas.sim.mesh_object import MeshObject
from touchatlas.sim.ply import ply_bytes
from touchatlas.sim.probe import Probe

RUN_FILES = (
    "run.toml",
    "journal.sqlite",
    "atlas.npz",
    "surface.ply",
    "steps.csv",
    "evaluation.json",
    "progress.png",
)
# What a killed run may leave beside them; SQLite would roll a stale one back into a new journal.
_LEFTOVERS = ("journal.sqlite-journal", *(f"{name}.part" for name in RUN_FILES))
_COLUMNS = (
    "touch",
    "reason",
    "x",
    "y",
    "z",
    "contours",
    "tracked_length",
    "travel_length",
    "patches",
    "parameters",
    "predicted_coverage",
    "predicted_deviation",
    "coverage",
    "completeness_mean",
    "seconds_plan",
    "seconds_fit",
    "seconds_sim",
)
# Truth triangles may be off the true surface by this share of the tolerance.
_TRUTH_SAGITTA = 0.01
# The true progress is looked at this often, in touches, at this many points.
_LOOK_EVERY, _LOOK_POINTS = 5, 2000


@dataclass(frozen=True)
class RunOptions:
    """What is asked of one exploration.

    Parameters
    ----------
    noise : float, length, optional
        Standard deviation of each coordinate of each point; the object's own when None.
    tolerance : float, length, optional
        How well the surface is wanted; the object's own when None.
    max_touches : int, optional
    max_length : float, length, optional
        Of tracking in contact.
    seed : int
    """

    noise: float | None = None
    tolerance: float | None = None
    max_touches: int | None = None
    max_length: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value, least in (
            ("noise", self.noise, 0.0),
            ("tolerance", self.tolerance, None),
            ("max-touches", self.max_touches, 1),
            ("max-length", self.max_length, None),
            ("seed", self.seed, 0),
        ):
            if value is None:
                continue
            good = value > 0 if least is None else value >= least
            if not (np.isfinite(value) and good):
                need = "> 0" if least is None else f">= {least:g}"
                raise ValueError(f"{name} is {value}; it must be {need}")


@dataclass(frozen=True, eq=False)
class Result:
    """What came of a run: the atlas, its surface, and the numbers of evaluation.json."""

    atlas: Atlas
    surface: Surface | None
    numbers: dict
    interrupted: bool


def create_folder(path, force: bool) -> Path:
    """The run folder, made or taken over; only the files of a run are ever removed.

    Raises
    ------
    ValueError
        When it holds something and ``force`` is not set, or holds files of the same names that
        are no run's.
    OSError
        When it cannot be made or written.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; give a folder for the run with --out")
    is_run = (path / "run.toml").exists()
    if path.is_dir() and any(path.iterdir()):
        if not force:
            what = "already holds a run" if is_run else "is not empty"
            raise ValueError(f"{path} {what}; choose another --out, or --force to replace a run")
        strangers = [] if is_run else [n for n in RUN_FILES if (path / n).exists()]
        if strangers:
            raise ValueError(
                f"{path} is no run, but holds {', '.join(strangers)}, which a run would "
                "overwrite; choose another --out"
            )
    path.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path):
        pass
    # run.toml goes last: while it is there, what else is left is known to be a run's.
    for name in (*_LEFTOVERS, *reversed(RUN_FILES)) if is_run else ():
        (path / name).unlink(missing_ok=True)
    return path


def random_streams(seed: int) -> list[np.random.Generator]:
    """Independent generators of one seed: the probe's noise, the judge, the true progress."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3)]


def run_exploration(
    obj: ImplicitObject | MeshObject,
    out,
    options: RunOptions = RunOptions(),
    force: bool = False,
    watch: Callable[[Step, Atlas], None] = lambda step, atlas: None,
) -> Result:
    """Explore an object, write the run folder, evaluate.

    Parameters
    ----------
    obj : the object; only the probe and the judge see it
    out : path of the run folder
    options : RunOptions
    force : bool
        Replace the run that the folder holds.
    watch : called after each touch, for progress

    Notes
    -----
    An interrupt (Ctrl-C) ends the exploration after the touch that is under way, not the
    evaluation of what was learned; a second one ends all at once. Touches already in the journal
    stay there, whatever happens.
    """
    noise = obj.noise_std if options.noise is None else options.noise
    tolerance = obj.tolerance if options.tolerance is None else options.tolerance
    probe_rng, judge_rng, look_rng = random_streams(options.seed)
    atlas = Atlas(tolerance)
    start, outward = obj.start()
    planner = Planner(start, outward)
    probe = Probe(obj, noise, probe_rng)
    folder = create_folder(out, force)
    text = _toml(_settings(obj, noise, tolerance, options, atlas, planner))
    write_whole(folder / "run.toml", text.encode())
    look = obj.sample(_LOOK_POINTS, look_rng)[0]
    rows: list[dict] = []
    steps = explore(atlas, planner, probe, options.max_touches, options.max_length)
    with _kept(folder, rows) as journal, _interrupt() as interrupted:
        for step in steps:
            journal.append(step.plan, step.touch)
            rows.append(_row(step, atlas, rows))
            if step.plan.number % _LOOK_EVERY == 0:
                _look(rows[-1], atlas, look)
            watch(step, atlas)
            if interrupted():
                break
        if rows:
            _look(rows[-1], atlas, look)
        stopped = interrupted()
    atlas.retile()
    save_atlas(folder / "atlas.npz", atlas)
    surface, numbers = _judge(obj, atlas, rows, noise, judge_rng)
    if surface is not None:
        write_whole(folder / "surface.ply", ply_bytes(surface))
    write_whole(folder / "evaluation.json", (json.dumps(numbers, indent=2) + "\n").encode())
    if rows:
        write_whole(folder / "progress.png", _plot(rows, obj.name))
    return Result(atlas, surface, numbers, stopped)


@contextmanager
def _kept(folder: Path, rows) -> Iterator[Journal]:
    """The journal of a run; ``rows`` become steps.csv however the exploration ends."""
    path = folder / "journal.sqlite"
    journal = None
    try:
        journal = Journal(path)
        yield journal
    except sqlite3.Error as error:
        with suppress(OSError):
            write_whole(folder / "steps.csv", _csv(rows))
        raise OSError(
            f"{path} cannot be written ({error}) after {len(rows)} touches, which are kept; "
            "free some space or choose another --out"
        ) from None
    except BaseException:
        with suppress(OSError):
            write_whole(folder / "steps.csv", _csv(rows))
        raise
    finally:
        if journal is not None:
            journal.close()
    write_whole(folder / "steps.csv", _csv(rows))


@contextmanager
def _interrupt() -> Iterator[Callable[[], bool]]:
    """Holds Ctrl-C back until it is asked for: an atlas must not be left in the midst of a
    touch. A second Ctrl-C interrupts at once."""
    came: list[int] = []

    def note(number, _frame) -> None:
        if came:
            raise KeyboardInterrupt
        came.append(number)

    # Signals belong to the main thread, and one that is ignored (nohup) stays so.
    ours = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT)
    if not ours or before in (signal.SIG_IGN, None):
        yield lambda: False
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGINT, before)


def truth_of(obj, tolerance: float, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """The object as the judge sees it."""
    points, normals = obj.sample(options.samples, rng)
    vertices, faces = obj.mesh(_TRUTH_SAGITTA * tolerance)
    return Truth(vertices, faces, points, normals, obj.closed, obj.euler_characteristic)


def _judge(obj, atlas: Atlas, rows, noise: float, rng):
    """The surface, and the contents of evaluation.json: None what no surface has."""
    surface = None
    numbers: dict = dict.fromkeys(field.name for field in fields(Evaluation))
    numbers |= {"coverage": 0.0, "f_score": 0.0, "watertight": False}
    numbers["true_euler_characteristic"] = obj.euler_characteristic if obj.closed else None
    numbers["total_curvature_over_2pi"] = None
    start = time.perf_counter()
    if len(atlas):
        surface = extract_surface(atlas)
    seconds_surface = time.perf_counter() - start
    if surface is not None and len(surface.faces):
        evaluation: Evaluation = evaluate_surface(
            surface.vertices,
            surface.faces,
            truth_of(obj, atlas.tolerance, rng),
            atlas.tolerance,
            rng,
            surface.deviation,
        )
        numbers |= evaluation.as_dict()
        numbers["total_curvature_over_2pi"] = surface.total_curvature() / (2.0 * np.pi)
    last = rows[-1] if rows else {"tracked_length": 0.0, "travel_length": 0.0}
    numbers |= {
        "noise_std": noise,
        "tolerance": atlas.tolerance,
        "diagonal": obj.diagonal,
        "touches": len(rows),
        "contours": sum(row["contours"] for row in rows),
        "points": atlas.point_count,
        "patches": len(atlas),
        "parameters": atlas.parameter_count,
        "patch_euler_characteristic": atlas.euler_characteristic(),
        "tracked_length": last["tracked_length"],
        "travel_length": last["travel_length"],
        "seconds_fit": sum(row["seconds_fit"] for row in rows),
        "seconds_plan": sum(row["seconds_plan"] for row in rows),
        "seconds_surface": seconds_surface,
        "seconds_sim": sum(row["seconds_sim"] for row in rows),
    }
    return surface, numbers


def _row(step: Step, atlas: Atlas, rows) -> dict:
    """One line of steps.csv; the truth's columns are blank until it is looked at."""
    before = rows[-1] if rows else {"tracked_length": 0.0, "travel_length": 0.0}
    values = (
        step.plan.number,
        step.plan.reason.value,
        *step.touch.contact.tolist(),
        len(step.touch.contours),
        before["tracked_length"] + step.touch.tracked_length,
        before["travel_length"] + step.touch.travel_length,
        len(atlas),
        atlas.parameter_count,
        atlas.predicted_coverage(),
        atlas.predicted_deviation() if len(atlas) else "",
        "",
        "",
        step.seconds_plan,
        step.seconds_fit,
        step.seconds_touch,
    )
    return dict(zip(_COLUMNS, values, strict=True))


def _look(row: dict, atlas: Atlas, points) -> None:
    """Fill the truth's columns: the share of true points that the atlas has within three
    tolerances, and their mean error."""
    distance = np.abs(atlas.blend(points).distance)
    near = distance <= 3.0 * atlas.tolerance
    row["coverage"] = float(near.mean())
    row["completeness_mean"] = float(distance[near].mean()) if near.any() else ""


def _csv(rows) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=_COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def _settings(obj, noise, tolerance, options: RunOptions, atlas: Atlas, planner: Planner) -> dict:
    """What run.toml says: the resolved options and the versions that made the run."""
    packages = ("touchatlas", "numpy", "scipy", "networkx", "trimesh", "libigl")
    return {
        "object": obj.source,
        **asdict(options),
        "noise": float(noise),
        "tolerance": float(tolerance),
        "atlas": asdict(atlas.options),
        "planner": asdict(planner.options),
        "versions": {"python": platform.python_version()} | {p: version(p) for p in packages},
    }


def read_settings(folder) -> dict:
    """run.toml of a finished run.

    Raises
    ------
    ValueError
        When the folder holds none, or one without the object, tolerance and seed of the run.
    """
    path = Path(folder) / "run.toml"
    if not path.is_file() or not path.with_name("surface.ply").is_file():
        raise ValueError(f"{folder} is not the folder of a finished run; run explore first")
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path} cannot be read ({error}); explore again") from None
    kinds = {"object": str, "tolerance": float, "seed": int}
    wrong = [name for name, kind in kinds.items() if not isinstance(settings.get(name), kind)]
    if wrong:
        raise ValueError(f"{path} lacks a proper {' and '.join(wrong)}; explore again")
    return settings


def _toml(table: dict, name: str = "") -> str:
    """A dictionary of numbers, strings and dictionaries as TOML; None is left out."""
    lines, inner = [], []
    for key, value in table.items():
        if isinstance(value, dict):
            path = f"{name}.{key}" if name else key
            inner.append(f"\n[{path}]\n{_toml(value, path)}")
        elif value is not None:
            # TOML's words are JSON's, but for surrogate pairs and infinite numbers.
            word = json.dumps(value, ensure_ascii=False, default=lambda number: number.item())
            word = repr(float(value)) if isinstance(value, float) else word
            lines.append(f"{key} = {word}\n")
    return "".join(lines + inner)


def _plot(rows, name: str) -> bytes:
    """Coverage and mean error against tracked length, as PNG."""
    # Not through pyplot, whose choice of back end is the caller's own.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    _curve(left, rows, "predicted_coverage", "outlines closed", "-")
    _curve(left, rows, "coverage", "true coverage", "o-")
    left.set(xlabel="tracked length", ylabel="coverage", ylim=(0, 1.02))
    left.set_title(name, parse_math=False)
    left.legend()
    _curve(right, rows, "predicted_deviation", "predicted deviation", "-")
    _curve(right, rows, "completeness_mean", "true mean error", "o-")
    right.set(xlabel="tracked length", ylabel="length", title="where it is covered")
    if any(y > 0.0 for line in right.lines for y in line.get_ydata()):
        right.set_yscale("log")
    right.legend()
    image = io.BytesIO()
    figure.savefig(image, dpi=110, metadata={"Software": None})
    return image.getvalue()


def _curve(axes, rows, column: str, label: str, style: str) -> None:
    """A column against tracked length, where it is filled."""
    seen = [row for row in rows if row[column] != ""]
    length = [row["tracked_length"] for row in seen]
    axes.plot(length, [row[column] for row in seen], style, ms=3, label=label)
