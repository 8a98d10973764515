"""touchatlas evaluate: the command."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchatlas.sim.command.numbers import All, Json, print_numbers, unit_hint
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.folder.run_folder import is_learning, read_finished
from touchatlas.sim.folder.run_options import check_tolerance
from touchatlas.sim.judge.comparison import stored_numbers
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.run.conclusion import truth_of, unit_of
from touchatlas.sim.run.work import random_streams
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.objects import digest_of, make_object, object_names


def evaluate(
    surface: Path,
    /,
    *,
    truth: str | None = None,
    tolerance: float | None = None,
    all_: All = False,
    json_: Json = False,
) -> int:
    """Compare a surface with the ground truth, both ways.

    Parameters
    ----------
    surface
        A mesh file, or the folder of a run, of which surface.ply is used.
    truth
        A mesh file or built-in object; the run's own object by default. If that is gone, the
        numbers are those of the end of the run.
    tolerance
        How well the surface is wanted, in the file's unit (mm for built-in objects). By default
        that of the run, else 1e-3 of the diagonal of a mesh, or what touchatlas objects lists.
    """
    run = read_finished(surface) if surface.is_dir() else None
    if run is not None and truth is None and is_learning(surface):
        raise ValueError(
            f"{surface} was learned from files, whose truth is not known; name a mesh with --truth"
        )
    if run is not None and truth is None and tolerance is None and not _is_found(run["object"]):
        return _stored(surface, run["object"], json_, all_)
    if run is None:
        request = _of_file(surface, truth, tolerance)
    else:
        request = _of_run(surface, run, truth, tolerance)
    obj, size, numbers = _compared(request)
    if hint := unit_hint(size, obj.diagonal):
        say(hint)
    print_numbers(numbers, f"{request.surface} against {obj.name}", json_, all_)
    return 0


@dataclass(frozen=True)
class _Request:
    """What is compared: a surface file with a truth, by name or path.

    Parameters
    ----------
    surface : Path
    truth : str
    tolerance : float, length, optional
        That of the truth by default.
    seed : int
    digest : str, optional
        What the truth must be.
    """

    surface: Path
    truth: str
    tolerance: float | None
    seed: int = 0
    digest: str | None = None


def _of_run(folder: Path, run: dict, truth: str | None, tolerance: float | None) -> _Request:
    """What is compared of a run, by default with its own object and tolerance."""
    digest = run.get("digest") if truth is None else None
    truth = run["object"] if truth is None else truth
    tolerance = run["tolerance"] if tolerance is None else tolerance
    return _Request(folder / "surface.ply", truth, tolerance, run["seed"], digest)


def _of_file(surface: Path, truth: str | None, tolerance: float | None) -> _Request:
    """What is compared of a mesh file, whose truth must be named."""
    if not surface.is_file():
        what = f"there is no file {surface}"
        if surface.exists():
            what = f"{surface} is a device or a pipe"
        raise ValueError(f"{what}; give a mesh file, or the folder of a run")
    if truth is None:
        raise ValueError("no truth was given; name a mesh file or built-in object with --truth")
    return _Request(surface, truth, tolerance)


def _is_found(truth: str) -> bool:
    """Whether a truth is a built-in object or a file."""
    return truth in object_names() or Path(truth).exists()


def _compared(request: _Request) -> tuple[ImplicitObject | MeshObject, float, dict]:
    """The object of the truth, the size of the surface, length, and the numbers of the
    comparison."""
    with shown(f"reading {request.surface}") as watcher:
        vertices, faces, deviation, notes = load_surface(request.surface)
        watcher.begins(f"preparing {request.truth}")
        obj = _truth_object(request)
        tolerance = obj.tolerance if request.tolerance is None else request.tolerance
        check_tolerance(tolerance, obj.diagonal)
        rng = random_streams(request.seed)[1]
        known = truth_of(obj, tolerance, rng)
        watcher.begins("comparing the surface with the truth")
        found = evaluate_surface(vertices, faces, known, tolerance, rng, deviation)
    size = float(np.linalg.norm(np.ptp(vertices[np.unique(faces)], axis=0)))
    for sentence in dict.fromkeys([*notes, *getattr(obj, "notes", ())]):
        say(sentence)
    return obj, size, found.as_dict() | {"unit": unit_of(obj)}


def _truth_object(request: _Request) -> ImplicitObject | MeshObject:
    """The object of the truth, the one that the run was made with."""
    obj = make_object(request.truth, request.seed)
    if request.digest is not None and digest_of(obj) != request.digest:
        raise ValueError(
            f"{request.truth} has changed since the run was made; put the old one back, or name a "
            "truth with --truth"
        )
    return obj


def _stored(run: Path, truth: str, as_json: bool, every: bool) -> int:
    """Print what was measured at the end of a run, whose truth is gone."""
    numbers = stored_numbers(run)
    say(
        f"there is no file {truth} any more, so nothing was measured again: these are the numbers "
        "of the end of the run; name another truth with --truth"
    )
    print_numbers(numbers, f"{run} against {truth}", as_json, every)
    return 0
