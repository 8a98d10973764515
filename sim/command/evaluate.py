"""touchatlas evaluate: the command."""

from pathlib import Path

import numpy as np

from touchatlas.sim.command.numbers import Json, print_numbers, sentences, unit_hint
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.folder.run_folder import read_finished
from touchatlas.sim.folder.run_options import check_tolerance
from touchatlas.sim.judge.comparison import stored_numbers
from touchatlas.sim.judge.evaluate import evaluate_surface
from touchatlas.sim.judge.surface_file import load_surface
from touchatlas.sim.run.conclusion import truth_of
from touchatlas.sim.run.work import random_streams
from touchatlas.sim.world.objects import digest_of, make_object, object_names, unit_of


def evaluate(
    surface: Path,
    /,
    *,
    truth: str | None = None,
    tolerance: float | None = None,
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
        1e-3 of the truth's diagonal, or the run's own, by default.
    """
    seed, expected = 0, None
    if surface.is_dir():
        run = read_finished(surface)
        if truth is None:
            truth, expected = run["object"], run.get("digest")
            if tolerance is None and not (truth in object_names() or Path(truth).exists()):
                return _stored(surface, truth, json_)
        tolerance = run["tolerance"] if tolerance is None else tolerance
        seed, surface = run["seed"], surface / "surface.ply"
    elif not surface.is_file():
        what = (
            f"{surface} is a device or a pipe"
            if surface.exists()
            else f"there is no file {surface}"
        )
        raise ValueError(f"{what}; give a mesh file, or the folder of a run")
    if truth is None:
        raise ValueError("no truth was given; name a mesh file or built-in object with --truth")
    with shown(f"reading {surface}") as watcher:
        vertices, faces, deviation = load_surface(surface)
        watcher.begins(f"preparing {truth}")
        obj = make_object(truth, seed)
        if expected is not None and digest_of(obj) != expected:
            raise ValueError(
                f"{truth} has changed since the run was made; put the old one back, or name a "
                "truth with --truth"
            )
        tolerance = obj.tolerance if tolerance is None else tolerance
        check_tolerance(tolerance, obj.diagonal)
        rng = random_streams(seed)[1]
        known = truth_of(obj, tolerance, rng)
        watcher.begins("comparing the surface with the truth")
        found = evaluate_surface(vertices, faces, known, tolerance, rng, deviation)
    numbers = found.as_dict() | {"unit": unit_of(obj)}
    print_numbers(numbers, f"{surface} against {obj.name}", json_)
    size = float(np.linalg.norm(np.ptp(vertices[np.unique(faces)], axis=0)))
    for sentence in (unit_hint(size, obj.diagonal), *sentences(numbers)):
        if sentence is not None:
            say(sentence)
    return 0


def _stored(run: Path, truth: str, as_json: bool) -> int:
    """Print what was measured at the end of a run, whose truth is gone."""
    numbers = stored_numbers(run)
    print_numbers(numbers, f"{run} against {truth}", as_json)
    say(
        f"there is no file {truth} any more, so nothing was measured again: these are the numbers "
        "of the end of the run; name another truth with --truth"
    )
    for sentence in sentences(numbers):
        say(sentence)
    return 0
