"""The run folder: explore a simulated object, judge it, and keep everything."""

import csv
import io
import json
import platform
import shutil
from collections.abc import Callable
from dataclasses import dataclass
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
# Truth triangles may be off the true surface by this share of the tolerance.
_TRUTH_SAGITTA = 0.01
# The true progress is looked at this often, in touches, at this many points.
_LOOK_EVERY, _LOOK_POINTS = 10, 2000


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
    """The run folder, made or taken over.

    Raises
    ------
    ValueError
        When it holds something and ``force`` is not set.
    OSError
        When it cannot be made or written.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; give a folder for the run with --out")
    if path.is_dir() and any(path.iterdir()):
        if not force:
            raise ValueError(
                f"{path} already holds a run; choose another --out, or --force to replace it"
            )
        for name in RUN_FILES:
            (path / name).unlink(missing_ok=True)
    path.mkdir(parents=True, exist_ok=True)
    probe = path / ".writable"
    probe.touch()
    probe.unlink()
    return path


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
    An interrupt (Ctrl-C) ends the exploration, not the evaluation of what was learned.
    """
    noise = obj.noise_std if options.noise is None else options.noise
    tolerance = obj.tolerance if options.tolerance is None else options.tolerance
    probe_rng, judge_rng = (
        np.random.default_rng(s) for s in np.random.SeedSequence(options.seed).spawn(2)
    )
    atlas = Atlas(tolerance)
    start, outward = obj.start()
    planner = Planner(start, outward)
    probe = Probe(obj, noise, probe_rng)
    folder = create_folder(out, force)
    write_whole(folder / "run.toml", _toml(obj, noise, tolerance, options).encode())
    look = obj.sample(_LOOK_POINTS, np.random.default_rng(options.seed))[0]
    journal = Journal(folder / "journal.sqlite")
    rows: list[dict] = []
    interrupted = False
    try:
        for step in explore(atlas, planner, probe, options.max_touches, options.max_length):
            journal.append(step.plan, step.touch)
            rows.append(_row(step, atlas, rows, look, tolerance))
            watch(step, atlas)
    except KeyboardInterrupt:
        interrupted = True
    finally:
        journal.close()
        write_whole(folder / "steps.csv", _csv(rows))
    atlas.retile()
    save_atlas(folder / "atlas.npz", atlas)
    surface, numbers = _judge(obj, atlas, rows, noise, judge_rng)
    if surface is not None:
        write_whole(folder / "surface.ply", ply_bytes(surface))
    text = json.dumps(numbers, indent=2) + "\n"
    write_whole(folder / "evaluation.json", text.encode())
    if rows:
        _plot(folder / "progress.png", rows, obj.name)
    return Result(atlas, surface, numbers, interrupted)


def truth_of(obj, tolerance: float, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """The object as the judge sees it."""
    points, normals = obj.sample(options.samples, rng)
    vertices, faces = obj.mesh(_TRUTH_SAGITTA * tolerance)
    return Truth(vertices, faces, points, normals, obj.closed, obj.euler_characteristic)


def _judge(obj, atlas: Atlas, rows, noise: float, rng):
    """The surface, and the contents of evaluation.json."""
    import time

    surface, numbers = None, {}
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
        numbers = evaluation.as_dict()
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


def _row(step: Step, atlas: Atlas, rows, look, tolerance: float) -> dict:
    """One line of steps.csv; the truth's columns are filled now and then."""
    number = len(rows)
    before = rows[-1] if rows else {"tracked_length": 0.0, "travel_length": 0.0}
    row = {
        "touch": number,
        "reason": step.plan.reason.value,
        **dict(zip("xyz", step.touch.contact.tolist(), strict=True)),
        "contours": len(step.touch.contours),
        "tracked_length": before["tracked_length"] + step.touch.tracked_length,
        "travel_length": before["travel_length"] + step.touch.travel_length,
        "patches": len(atlas),
        "parameters": atlas.parameter_count,
        "predicted_coverage": atlas.predicted_coverage(),
        "predicted_deviation": atlas.predicted_deviation(),
        "coverage": "",
        "completeness_mean": "",
        "seconds_plan": step.seconds_plan,
        "seconds_fit": step.seconds_fit,
        "seconds_sim": step.seconds_touch,
    }
    if number % _LOOK_EVERY == 0 and len(atlas):
        distance = np.abs(atlas.blend(look).distance)
        near = distance <= 3.0 * tolerance
        row["coverage"] = float(near.mean())
        row["completeness_mean"] = float(distance[near].mean()) if near.any() else ""
    return row


def _csv(rows) -> bytes:
    if not rows:
        return b""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def _toml(obj, noise, tolerance, options: RunOptions) -> str:
    """run.toml: the resolved options and the versions that made the run."""
    lines = [
        f"object = {json.dumps(obj.source)}",
        f"noise = {noise!r}",
        f"tolerance = {tolerance!r}",
        f"seed = {options.seed}",
    ]
    if options.max_touches is not None:
        lines.append(f"max_touches = {options.max_touches}")
    if options.max_length is not None:
        lines.append(f"max_length = {options.max_length!r}")
    lines += ["", "[versions]", f'python = "{platform.python_version()}"']
    lines += [f'{name} = "{version(name)}"' for name in ("touchatlas", "numpy", "scipy", "libigl")]
    return "\n".join(lines) + "\n"


def _plot(path: Path, rows, name: str) -> None:
    """Coverage and mean error against tracked length."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    length = [row["tracked_length"] for row in rows]
    left.plot(length, [row["predicted_coverage"] for row in rows], label="outlines closed")
    seen = [row for row in rows if row["coverage"] != ""]
    at = [row["tracked_length"] for row in seen]
    left.plot(at, [row["coverage"] for row in seen], "o-", ms=3, label="true coverage")
    left.set(xlabel="tracked length", ylabel="coverage", ylim=(0, 1.02), title=name)
    left.legend()
    right.plot(length, [row["predicted_deviation"] for row in rows], label="predicted deviation")
    known = [(x, row["completeness_mean"]) for x, row in zip(at, seen, strict=True)]
    known = [(x, y) for x, y in known if y != ""]
    right.plot([x for x, _ in known], [y for _, y in known], "o-", ms=3, label="true mean error")
    right.set(xlabel="tracked length", ylabel="length", yscale="log", title="where it is covered")
    right.legend()
    part = path.with_name("progress.part.png")
    figure.savefig(part, dpi=110, metadata={"Software": None})
    plt.close(figure)
    shutil.move(part, path)
