"""Families of whole surfaces: bodies and touches, each explored and judged."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas import Atlas, Surface, Touch, extract_surface
from touchatlas.atlas.check.doubt import Doubt
from touchatlas.atlas.check.doubts import doubts
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner import Planner, explore
from touchatlas.planner.stop import StopReason
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.machine.faults import shifted
from touchatlas.sim.study.bodies import (
    NOISE,
    TOLERANCE,
    Body,
    Placed,
    box,
    cup,
    dimpled,
    fork,
    handles,
    lumpy,
    slab,
    spike,
    two_balls,
)
from touchatlas.sim.study.family import Family
from touchatlas.sim.study.outcome import Outcome, Verdict, attempted, outcome_of
from touchatlas.sim.world.probe import Probe
from touchatlas.sim.world.triangles import sample_triangles


@dataclass(frozen=True, eq=False)
class Trial:
    """What is explored, and how it is judged.

    Parameters
    ----------
    body : Body
    tolerance, noise : float, length
    change : callable
        (number, touch) to the touch that the atlas gets instead.
    again : callable, optional
        All touches of the exploration to those that a new atlas learns instead.
    most : int
        Touches after which an exploration ends: four times what a smooth body takes.
    far, reached, held : float
        A good surface lies nowhere farther than so many tolerances from the truth; this fraction
        of the truth is as near to it; and this fraction of it is within 1.96 deviations.
    points : int
        At which either surface is compared with the other: the standard error of 0.99 is 0.0016.
    sagitta : float
        By which chords of the true triangles are off, in tolerances.
    """

    body: Body
    tolerance: float = TOLERANCE
    noise: float = NOISE * TOLERANCE
    change: Callable[[int, Touch], Touch] = lambda number, touch: touch
    again: Callable[[list[Touch]], list[Touch]] | None = None
    most: int = 120
    far: float = 3.0
    reached: float = 0.99
    held: float = 0.9
    points: int = 4000
    sagitta: float = 0.05


@dataclass(frozen=True, eq=False)
class Explored:
    """What came of a trial: the surface, or None where nothing was touched; doubts; how many
    touches were made, and why they ended."""

    surface: Surface | None
    doubts: tuple[Doubt, ...]
    touches: int
    stopped: str


def explored(trial: Trial, rng: np.random.Generator) -> Explored:
    """Explore as a run does, and ask the atlas what it doubts."""
    atlas, planner = _new_atlas(trial), Planner(*trial.body.start())
    probe = Probe(trial.body, trial.noise, rng)  # type: ignore[arg-type]
    touches: list[Touch] = []

    def changed(plan):
        touches.append(trial.change(plan.number, probe(plan)))
        return touches[-1]

    for _ in explore(atlas, planner, changed, trial.most):
        pass
    stop = planner.stop
    forecast = planner.forecast(atlas) if stop is None else stop.forecast
    if trial.again is not None:
        atlas = _new_atlas(trial)
        atlas.add_all(trial.again(touches))
        forecast = Planner(*trial.body.start()).forecast(atlas)
    atlas.finish()
    surface = extract_surface(atlas) if len(atlas) else None
    reason = "most touches were made" if stop is None else stop.reason.value
    known = stop is not None and stop.reason is StopReason.KNOWN
    known &= trial.again is None or forecast.predicted_coverage >= planner.options.coverage
    places = () if known else forecast.open_places
    found = doubts(atlas, surface, places, "" if known else reason)
    return Explored(surface, found, len(touches), reason)


def _new_atlas(trial: Trial) -> Atlas:
    return Atlas(trial.tolerance, scale=fit_scale(trial.noise, trial.body.diagonal))


def atlas_verdict(trial: Trial, rng: np.random.Generator) -> Verdict:
    """Explore and judge."""
    return attempted(lambda: judge_surface(explored(trial, rng), trial, rng))


def judge_surface(found: Explored, trial: Trial, rng) -> Verdict:
    """The law of whole surfaces.

    *Good* is a surface of the right Euler characteristic, without holes where the truth has none,
    of which no point is farther than three tolerances from the truth, which reaches 99 % of it, and
    of which 90 % lies within 1.96 predicted deviations.
    """
    names = tuple(doubt.name for doubt in found.doubts)
    if found.surface is None or not len(found.surface.faces):
        return Verdict(Outcome.FLAGGED, doubts=names, touches=found.touches)
    surface = found.surface
    error, held = _accuracy(surface, trial, rng)
    reached, true_euler = _completeness(surface, trial, rng)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    euler = int(mesh.euler_number)
    right = error <= trial.far * trial.tolerance and held >= trial.held
    right &= reached >= trial.reached and euler == true_euler
    right &= bool(mesh.is_watertight) or not trial.body.closed
    words = f"Euler {euler} of {true_euler}, {found.touches} touches, {found.stopped}"
    return Verdict(
        outcome_of(right, names),
        error / trial.tolerance,
        *(Verdict.ratios, held, reached, names, words, found.touches),
    )


def _accuracy(surface: Surface, trial: Trial, rng) -> tuple[float, float]:
    """Largest distance of the surface from the truth, and the fraction within 1.96 deviations."""
    points, face = sample_triangles(surface.vertices, surface.faces, trial.points, rng)
    every = np.concatenate([points, surface.vertices])
    off = ClosestPoints(*trial.body.mesh(trial.sagitta * trial.tolerance))(every)[0]
    deviation = surface.deviation[surface.faces[face]].max(axis=1)
    return float(off.max()), float(np.mean(off[: len(points)] <= SURE * deviation))


def _completeness(surface: Surface, trial: Trial, rng) -> tuple[float, int]:
    """Fraction of the found parts of the truth near the surface, and their V - E + F."""
    vertices, faces = trial.body.mesh(trial.sagitta * trial.tolerance)
    points, face = sample_triangles(vertices, faces, trial.points, rng)
    off = ClosestPoints(surface.vertices, surface.faces)(points)[0]
    near = off <= trial.far * trial.tolerance
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    _, label = connected_components(trimesh.graph.edges_to_coo(mesh.edges), directed=False)
    parts = np.unique(label[faces[face][near, 0]])
    own = np.isin(label[faces[face][:, 0]], parts)
    kept = trimesh.Trimesh(vertices, faces[np.isin(label[faces[:, 0]], parts)], process=False)
    return float(near[own].mean()) if own.any() else 0.0, int(kept.euler_number)


def _of(make: Callable[[float], Body], unit: float = 1.0):
    return lambda severity, rng: Trial(make(severity * unit))


def _noisy(ratio: float, rng) -> Trial:
    return Trial(lumpy(rng), noise=ratio * TOLERANCE)


def _tolerant(fraction: float, rng) -> Trial:
    """The noise is in proportion to the tolerance."""
    body = lumpy(rng)
    return Trial(body, fraction * body.diagonal, NOISE * fraction * body.diagonal)


def _moved(distance: float, rng, before: int = 4) -> Trial:
    """The object moves after some touches: half of what a body that stays takes."""
    body, shift = lumpy(rng), rng.normal(size=3)
    shift *= distance * TOLERANCE / np.linalg.norm(shift)
    change = lambda number, touch: shifted(touch, shift) if number >= before else touch  # noqa: E731
    return Trial(body, change=change)


def _shuffled(times: float, rng) -> Trial:
    """The touches in another order; given less than once, some are lost."""
    body, count = lumpy(rng), max(1, round(times))

    def again(touches):
        every = [touches[i] for i in rng.permutation(count * len(touches)) % len(touches)]
        return every[: round(times * len(touches))]

    return Trial(body, again=again)


def _scaled(scale: float, rng) -> Trial:
    body = Placed(lumpy(rng), scale, np.zeros(3))
    return Trial(body, scale * TOLERANCE, scale * NOISE * TOLERANCE)


def _far(distance: float, rng) -> Trial:
    body, direction = lumpy(rng), rng.normal(size=3)
    direction *= distance * body.diagonal / np.linalg.norm(direction)
    return Trial(Placed(body, 1.0, direction))


ATLAS_FAMILIES: dict[str, Family[Trial]] = {}


def _enter(name: str, draw: Callable, title: str, *severities: float) -> None:
    ATLAS_FAMILIES[f"atlas_{name}"] = Family(title, severities, draw)


_enter("noise", _noisy, "noise over tolerance", 0.0, 0.2, 0.5, 1.0, 3.0, 10.0)
_enter("tolerance", _tolerant, "tolerance over the diagonal", 1e-3, 3e-4, 1e-4, 3e-3, 0.01, 0.03)
_enter("slab", _of(slab), "thickness of a plate, mm", 20.0, 10.0, 5.0, 2.0, 1.0, 0.5)
_enter("gap", _of(fork), "width of a slot, mm", 16.0, 8.0, 4.0, 2.0, 1.0, 0.5)
_enter("edge", _of(box, TOLERANCE), "edge radius over tolerance", 100.0, 30.0, 10.0, 3.0, 1.0)
_enter("tip", _of(spike, TOLERANCE), "tip radius over tolerance", 100.0, 30.0, 10.0, 3.0, 1.0)
_enter("dimple", _of(dimpled), "width of a dimple, mm", 12.0, 6.0, 3.0, 1.5, 0.8, 0.4)
_enter("handles", _of(lambda n: handles(int(n))), "handles", 0.0, 1.0, 2.0, 3.0)
_enter("two", _of(two_balls), "gap between two balls, mm", 20.0, 5.0, 1.0, 0.3)
_enter("rim", _of(cup), "fraction of a ball that is open", 0.03, 0.1, 0.3, 0.5, 0.7)
_enter("moved", _moved, "move between touches, in tolerances", 0.0, 0.3, 1.0, 3.0, 10.0, 50.0)
_enter("order", _shuffled, "times that each touch is given", 1.0, 2.0, 3.0, 0.9, 0.7, 0.4)
_enter("scale", _scaled, "factor on all lengths", 1.0, 1e-3, 1e3, 1e-6, 1e6)
_enter("far", _far, "distance from the origin in diagonals", 0.0, 1e2, 1e4, 1e6)
