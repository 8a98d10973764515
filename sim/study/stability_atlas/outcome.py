"""What became of an exploration, by numbers: good, flagged, refused, wrong or crashed."""

import warnings
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas import Surface
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.judge.closest_points import closest_points
from touchatlas.sim.study.stability.outcome import Outcome, is_refusal
from touchatlas.sim.study.stability_atlas.trial import Body, Explored, Trial, explored
from touchatlas.sim.world.triangles import sample_triangles

# No surface may lie farther than this from the truth, nor more of the truth than the fraction
# from the surface, in tolerances.
_FAR, _REACHED = 3.0, 0.99
# Least fraction of the surface that lies within ``SURE`` predicted deviations. Doubled, none does.
_HELD = 0.9
# Points at which either surface is compared with the other: the standard error of 0.99 is 0.0016.
_POINTS = 4000
# Chords of the true triangles are off by this fraction of the tolerance.
_SAGITTA = 0.05


@dataclass(frozen=True)
class AtlasVerdict:
    """The outcome of one exploration.

    Parameters
    ----------
    outcome : Outcome
    error : float
        Largest distance of the surface from the truth, in tolerances; NaN without a surface.
    held : float
        Fraction of the surface within 1.96 predicted deviations of the truth.
    reached : float
        Fraction of the truth within three tolerances of the surface; parts of the body that were
        not found do not count.
    euler, true_euler : int
        V - E + F of the surface, and of the parts of the truth that were found.
    touches : int
    doubts : tuple of str
    words : str
        Why the exploration ended; or of the refusal or exception.
    """

    outcome: Outcome
    error: float = np.nan
    held: float = np.nan
    reached: float = np.nan
    euler: int = 0
    true_euler: int = 0
    touches: int = 0
    doubts: tuple[str, ...] = ()
    words: str = ""


def atlas_verdict(trial: Trial, rng: np.random.Generator) -> AtlasVerdict:
    """Explore and judge; a warning of numpy counts as a crash."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return judge(explored(trial, rng), trial, rng)
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        return AtlasVerdict(Outcome.REFUSED if is_refusal(error) else Outcome.CRASHED, words=words)


def judge(found: Explored, trial: Trial, rng) -> AtlasVerdict:
    """The law of the outcomes.

    *Good* is a surface of the right Euler characteristic, without holes where the truth has none,
    of which no point is farther than three tolerances from the truth, which reaches 99 % of it, and
    of which 90 % lies within 1.96 predicted deviations. Anything else is *flagged* where the atlas
    doubts itself, and *wrong* where it does not.
    """
    names = tuple(doubt.name for doubt in found.doubts)
    if found.surface is None or not len(found.surface.faces):
        return AtlasVerdict(Outcome.FLAGGED, touches=found.touches, doubts=names)
    surface, limit = found.surface, _FAR * trial.tolerance
    error, held = _accuracy(surface, trial, rng)
    reached, true_euler = _completeness(surface, trial.body, trial.tolerance, rng)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    euler = int(mesh.euler_number)
    good = error <= limit and held >= _HELD and reached >= _REACHED and euler == true_euler
    good &= bool(mesh.is_watertight) or not trial.body.closed
    outcome = Outcome.GOOD if good else Outcome.FLAGGED if names else Outcome.WRONG
    return AtlasVerdict(
        *(outcome, error / trial.tolerance, held, reached, euler, true_euler),
        *(found.touches, names, found.stopped),
    )


def _accuracy(surface: Surface, trial: Trial, rng) -> tuple[float, float]:
    """Largest distance of the surface from the truth, and the fraction within 1.96 deviations."""
    points, face = sample_triangles(surface.vertices, surface.faces, _POINTS, rng)
    every = np.concatenate([points, surface.vertices])
    off = closest_points(every, *trial.body.mesh(_SAGITTA * trial.tolerance))[0]
    deviation = surface.deviation[surface.faces[face]].max(axis=1)
    held = np.mean(off[: len(points)] <= SURE * deviation)
    return float(off.max()), float(held)


def _completeness(surface: Surface, body: Body, tolerance: float, rng) -> tuple[float, int]:
    """Fraction of the found parts of the truth within three tolerances, and their V - E + F."""
    vertices, faces = body.mesh(_SAGITTA * tolerance)
    points, face = sample_triangles(vertices, faces, _POINTS, rng)
    near = closest_points(points, surface.vertices, surface.faces)[0] <= _FAR * tolerance
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    _, label = connected_components(trimesh.graph.edges_to_coo(mesh.edges), directed=False)
    parts = np.unique(label[faces[face][near, 0]])
    own = np.isin(label[faces[face][:, 0]], parts)
    kept = trimesh.Trimesh(vertices, faces[np.isin(label[faces[:, 0]], parts)], process=False)
    return float(near[own].mean()) if own.any() else 0.0, int(kept.euler_number)
