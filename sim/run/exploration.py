"""A run: explore a simulated object, evaluate the atlas, and write the run folder."""

import json
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas, Surface, extract_surface, save_atlas
from touchatlas.atlas.files import write_whole
from touchatlas.planner import Planner, Step, explore
from touchatlas.sim.run.evaluate import EvaluateOptions, Evaluation, Truth, evaluate_surface
from touchatlas.sim.run.interrupt import held_interrupt
from touchatlas.sim.run.journal import Journal
from touchatlas.sim.run.ply import ply_bytes
from touchatlas.sim.run.progress import Progress
from touchatlas.sim.run.run_folder import create_folder, write_settings
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import Probe

# Truth triangles may be off the true surface by this fraction of the tolerance. Twice as much
# halves the number of triangles and adds 1 % of the tolerance to the measured errors.
_TRUTH_SAGITTA = 0.01
# Largest noise, in tolerances: the grid of a surface that is spread over more of them would not fit
# into memory. Twice as much needs a grid twice as fine for the same spread.
_NOISIEST = 1000
# Smallest tolerance, as a fraction of an object's diagonal: the rounding of its points, with three
# digits of slack. Twice as much would refuse nothing that anyone can measure.
_FINEST = 1e-12
# Points of the true surface at which the true progress is measured. Four times as many halve the
# standard error of the coverage, about 1 %.
_PROGRESS_POINTS = 2000


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
        _check("noise", self.noise, 0)
        _check("tolerance", self.tolerance)
        _check("max-touches", self.max_touches, 1)
        _check("max-length", self.max_length)
        _check("seed", self.seed, 0)


def _check(name: str, value: float | None, least: int | None = None) -> None:
    """ValueError for a number that is not finite, or is below ``least``; without ``least``, for
    one that is not positive."""
    if value is not None:
        good = value > 0 if least is None else value >= least
        # np.isfinite fails for integers of more than 64 bits.
        if not (good and value < np.inf):
            need = "> 0" if least is None else f">= {least}"
            raise ValueError(f"{name} is {value}; it must be finite and {need}")


@dataclass(frozen=True, eq=False)
class Result:
    """The result of a run: the atlas, its surface, and the numbers of evaluation.json."""

    atlas: Atlas
    surface: Surface | None
    numbers: dict
    interrupted: bool


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
    An interrupt (Ctrl-C) ends the exploration after the current touch; the atlas is still
    evaluated. A second interrupt ends the run at once. Touches already in the journal stay there,
    whatever happens.
    """
    noise = float(obj.noise_std if options.noise is None else options.noise)
    tolerance = float(obj.tolerance if options.tolerance is None else options.tolerance)
    _check_scale(noise, tolerance, obj.diagonal)
    probe_rng, judge_rng, progress_rng = random_streams(options.seed)
    atlas, planner = Atlas(tolerance), Planner(*obj.start())
    probe = Probe(obj, noise, probe_rng)
    folder = create_folder(out, force)
    settings = asdict(replace(options, noise=noise, tolerance=tolerance))
    parts = {"atlas": asdict(atlas.options), "planner": asdict(planner.options)}
    write_settings(folder, {"object": obj.source, **settings, **parts})
    progress = Progress(atlas, obj.sample(_PROGRESS_POINTS, progress_rng)[0])
    steps = explore(atlas, planner, probe, options.max_touches, options.max_length)
    stopped = _take(steps, folder, progress, lambda step: watch(step, atlas))
    surface, numbers = _conclude(obj, atlas, progress, folder, noise, judge_rng)
    return Result(atlas, surface, numbers, stopped)


def check_tolerance(tolerance: float, diagonal: float) -> None:
    """ValueError for a tolerance that does not suit an object of this diagonal."""
    _check("tolerance", tolerance)
    if tolerance > diagonal:
        raise ValueError(
            f"tolerance is {tolerance:g}, but the object is only {diagonal:.4g} across; "
            "give a smaller --tolerance"
        )
    if tolerance < _FINEST * diagonal:
        raise ValueError(
            f"tolerance is {tolerance:g}, but an object {diagonal:.4g} across has coordinates that "
            f"are rounded; give a --tolerance of {_FINEST * diagonal:.2g} or more"
        )


def _check_scale(noise: float, tolerance: float, diagonal: float) -> None:
    """ValueError for a noise and tolerance from which no surface can result; no file is written
    before."""
    check_tolerance(tolerance, diagonal)
    if noise > _NOISIEST * tolerance:
        raise ValueError(
            f"noise is {noise:g}, more than {_NOISIEST} times the tolerance {tolerance:g}; "
            "give a smaller --noise or a larger --tolerance"
        )


def _take(steps: Iterable[Step], folder: Path, progress: Progress, watch) -> bool:
    """Carry out the steps, each written before the next begins; true when interrupted."""
    # An interrupt within a touch would leave the atlas inconsistent.
    with _kept(folder, progress) as journal, held_interrupt() as interrupted:
        for step in steps:
            journal.append(step.plan, step.touch)
            progress.add(step)
            watch(step)
            if interrupted():
                break
        progress.measure()
        return interrupted()


@contextmanager
def _kept(folder: Path, progress: Progress) -> Iterator[Journal]:
    """The journal of a run. steps.csv is written, however the exploration ends."""
    path, steps = folder / "journal.sqlite", folder / "steps.csv"
    journal = None
    try:
        journal = Journal(path)
        yield journal
    except sqlite3.Error as error:
        with suppress(OSError):
            write_whole(steps, progress.csv_bytes())
        raise OSError(
            f"{path} cannot be written ({error}) after {len(progress.rows)} touches, which are "
            "kept; free some space or choose another --out"
        ) from None
    except BaseException:
        with suppress(OSError):
            write_whole(steps, progress.csv_bytes())
        raise
    finally:
        if journal is not None:
            journal.close()
    write_whole(steps, progress.csv_bytes())


def truth_of(obj, tolerance: float, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """The object as the judge sees it."""
    _check("tolerance", tolerance)
    points, normals = obj.sample(options.samples, rng)
    vertices, faces = obj.mesh(_TRUTH_SAGITTA * tolerance)
    return Truth(vertices, faces, points, normals, obj.closed, obj.euler_characteristic)


def _conclude(obj, atlas: Atlas, progress: Progress, folder: Path, noise: float, rng):
    """Surface and numbers of a run, and the files of what was learned."""
    residual_patches = atlas.finish()
    save_atlas(folder / "atlas.npz", atlas)
    start = time.perf_counter()
    surface = extract_surface(atlas) if len(atlas) else None
    seconds = time.perf_counter() - start
    numbers = _quality(obj, atlas, surface, rng)
    numbers |= {"noise_std": noise} | _expense(atlas, progress, seconds)
    numbers["residual_patches"] = residual_patches
    if surface is not None:
        write_whole(folder / "surface.ply", ply_bytes(surface))
    write_whole(folder / "evaluation.json", (json.dumps(numbers, indent=2) + "\n").encode())
    if progress.rows:
        write_whole(folder / "progress.png", progress.png_bytes(obj.name))
    return surface, numbers


def _quality(obj, atlas: Atlas, surface: Surface | None, rng) -> dict:
    """How good the surface is; without a surface the numbers are None or zero."""
    numbers: dict = dict.fromkeys(field.name for field in fields(Evaluation))
    numbers |= {"coverage": 0.0, "f_score": 0.0, "watertight": False}
    numbers["true_euler_characteristic"] = obj.euler_characteristic if obj.closed else None
    numbers |= {"total_curvature_over_2pi": None, "diagonal": obj.diagonal}
    if surface is not None and len(surface.faces):
        evaluation = evaluate_surface(
            surface.vertices,
            surface.faces,
            truth_of(obj, atlas.tolerance, rng),
            atlas.tolerance,
            rng,
            surface.deviation,
        )
        numbers |= evaluation.as_dict()
        numbers["total_curvature_over_2pi"] = surface.total_curvature() / (2.0 * np.pi)
    return numbers | {"tolerance": atlas.tolerance}


def _expense(atlas: Atlas, progress: Progress, seconds_surface: float) -> dict:
    """Numbers of touches, samples and patches, lengths, and seconds."""
    return {
        "touches": len(progress.rows),
        "contours": progress.sum("contours"),
        "points": atlas.point_count,
        "patches": len(atlas),
        "parameters": atlas.parameter_count,
        "patch_euler_characteristic": atlas.euler_characteristic(),
        "tracked_length": progress.last("tracked_length"),
        "travel_length": progress.last("travel_length"),
        "seconds_fit": progress.sum("seconds_fit"),
        "seconds_plan": progress.sum("seconds_plan"),
        "seconds_surface": seconds_surface,
        "seconds_sim": progress.sum("seconds_sim"),
    }
