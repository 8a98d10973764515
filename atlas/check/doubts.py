"""Doubts about an atlas, in words that a person can act on: what its own samples say against it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.check.contradictions import claims, contradictions, shift_between
from touchatlas.atlas.state import AtlasState

# Largest cosine of the normals of two sheets that face away from each other: 120 degrees. Doubled,
# only parallel sheets are compared.
_OPPOSITE = -0.5
# Fraction of the samples that may contradict: good explorations have none. Doubled, one bad
# contact in five hundred is no doubt.
_FEW = 1e-3
# Least fraction of the contradicting distances, as a sum of squares, that one shift of the object
# explains, and least number of them, ten for each of its three numbers. Doubled, few moves are
# told from detail.
_EXPLAINED, _LEAST = 0.5, 30
# Distance of a sample from a face that contradicts it, in deviations: chance gives one in two
# million. Doubled, only gross errors are doubted.
_FAR = 5.0
# Excess of the chi-square of a patch's residuals, in its standard deviations: chance exceeds it in
# one patch of 300,000. Doubled, patches pass that lie between two places of a moved object.
_EXCESS = 4.5
# Distance of two sheets below which their triangles may run into each other, in tolerances.
# Doubled, walls are doubted that are drawn right.
_CLOSE = 4.0
# Rounding of exact contacts over the radius: the fit takes noise to be no less.
_ROUNDING = 1e-6
# Distance between places of one doubt, over the extent, and how many are named. Doubled, fewer or
# more places are named.
_APART, _MOST = 0.1, 5


# The reason of a planner that has reached its end.
_KNOWN = "known to the tolerance"


class Forecast(Protocol):
    """What a planner's Stop expects of the surface, as far as it is read here."""

    @property
    def predicted_coverage(self) -> float: ...
    @property
    def open_places(self) -> np.ndarray: ...


class Stopped(Protocol):
    """A planner's Stop, as far as it is read here; its ``reason`` is an Enum of words."""

    @property
    def reason(self) -> Enum: ...
    @property
    def forecast(self) -> Forecast: ...
    @property
    def unreachable(self) -> np.ndarray: ...


class Triangles(Protocol):
    """Vertices (v, 3), length, faces (f, 3), and middles (h, 3) of closed holes of a Surface."""

    @property
    def vertices(self) -> np.ndarray: ...
    @property
    def faces(self) -> np.ndarray: ...
    @property
    def closed_holes(self) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Doubt:
    """Something that speaks against an atlas.

    Parameters
    ----------
    name : str
        Short name, always the same for the same kind.
    words : str
        What was found and what to do, one sentence.
    places : (k, 3) float, length, world
        Where, five places at most; none where it concerns the whole.
    """

    name: str
    words: str
    places: np.ndarray

    def as_dict(self) -> dict:
        """The doubt, ready for JSON."""
        return {"name": self.name, "words": self.words, "places": self.places.tolist()}


def doubts(
    atlas: AtlasState,
    surface: Triangles | None = None,
    open_places: Sequence | np.ndarray = (),
    stopped: str | Stopped | None = "",
    unreachable: Sequence | np.ndarray = (),
) -> tuple[Doubt, ...]:
    """What speaks against an atlas; empty where nothing does.

    Parameters
    ----------
    atlas : AtlasState
    surface : Surface, optional
        The atlas's Surface, whose pieces and holes are looked at.
    open_places : (k, 3) float, length, world
        Where a planner says that too little is known (``Forecast.open_places``).
    stopped : Stop or str, optional
        Why the exploration ended: a planner's ``stop``, whose places are taken if none are given,
        or words. It is no doubt if nothing is given, or the surface is known to the tolerance.
    unreachable : (k, 3) float, length, world
        Where a planner found no way for its pin (``Stop.unreachable``).

    Returns
    -------
    tuple of Doubt
        In the order of how much they say.
    """
    if stopped is not None and not isinstance(stopped, str):
        stopped, open_places, unreachable = _of_stop(stopped, open_places, unreachable)
    found = []
    if stopped and stopped != _KNOWN:
        found.append(Doubt("unfinished", f"The exploration ended early: {stopped}.", _NOWHERE))
    places = np.reshape(np.asarray(open_places, float), (-1, 3))
    if len(places):
        found.append(
            Doubt(
                "open places",
                f"{_count(len(places), 'place is', 'places are')} not known to the tolerance; "
                "touch there.",
                places[:_MOST],
            )
        )
    places = np.reshape(np.asarray(unreachable, float), (-1, 3))
    if len(places):
        words = (
            f"{_count(len(places), 'place was', 'places were')} not touched, because the pin would "
            "have passed through what is known; lean it, or take a thinner one."
        )
        found.append(Doubt("unreachable", words, _apart(places, _extent(places))))
    if len(atlas):
        extent = _extent(atlas.membership.pool.points)
        if atlas.body is None:
            found += _contradictions(atlas, extent) + _misfits(atlas, extent)
            found += _close_sheets(atlas, extent)
        else:
            found += _beside_faces(atlas, extent)
        found += _lost_contact(atlas, extent)
    return (*found, *_topology(surface, atlas))


_NOWHERE = np.zeros((0, 3))


def _of_stop(stop: Stopped, open_places, unreachable):
    """Words of a planner's Stop, and its places where no others are given."""
    words = str(stop.reason.value)
    if not len(unreachable):
        unreachable = stop.unreachable
    if words == _KNOWN:
        return words, open_places, unreachable
    share = stop.forecast.predicted_coverage
    if not len(open_places):
        open_places = stop.forecast.open_places
    return f"{words}, with {share:.1%} of the surface {_KNOWN}", open_places, unreachable


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def _extent(points) -> float:
    """Diagonal of the bounding box of points (n, 3)."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _apart(points, extent: float) -> np.ndarray:
    """The first of points (n, 3) that are far from each other, five at most."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(((point - other) ** 2).sum() > (_APART * extent) ** 2 for other in kept):
            kept.append(point)
        if len(kept) == _MOST:
            break
    return np.reshape(kept, (-1, 3))


def _contradictions(atlas: AtlasState, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside patches that claim their place."""
    pool, off = atlas.membership.pool, contradictions(atlas, surely=False)
    if len(off.sample) >= _LEAST:
        shift, explained = shift_between(atlas, off)
        if explained > _EXPLAINED:
            samples = np.unique(off.sample)
            words = (
                f"{len(samples) / len(pool):.1%} of the samples lie beside patches of other "
                f"touches as if the object had moved by {np.linalg.norm(shift):.3g} or more; fix "
                "it, and explore again."
            )
            return [Doubt("moved", words, _apart(pool.points[samples], extent))]
    samples = np.unique(contradictions(atlas).sample)
    if len(samples) <= _FEW * len(pool):
        return []
    places, share = _apart(pool.points[samples], extent), len(samples) / len(pool)
    words = (
        f"{share:.1%} of the samples lie more than five deviations beside a patch; there is an "
        "edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, places)]


def _beside_faces(atlas: AtlasState, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside the lawful faces that the surface is drawn from."""
    points = atlas.membership.pool.points
    off = np.abs(atlas.blend(points).distance) > _FAR * atlas.sample_std
    if off.sum() <= _FEW * len(points):
        return []
    words = (
        f"{off.mean():.1%} of the samples lie more than five deviations beside a face; there is an "
        "edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, _apart(points[off], extent))]


def _misfits(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Patches whose samples lie farther off than their noise explains."""
    table, rows = atlas.table, atlas.table.rows
    freedom = np.maximum(table.count[rows] - table.basis.size, 1.0)
    ratio = table.residual[rows] / np.maximum(table.noise[rows], _ROUNDING * table.radius[rows])
    bad = rows[(ratio**2 - 1.0) * np.sqrt(0.5 * freedom) > _EXCESS]
    if not len(bad):
        return []
    worst = bad[np.argsort(-table.residual[bad])]
    words = (
        f"{_count(len(bad), 'patch misses its samples', 'patches miss their samples')} by more "
        "than the noise; there is finer detail, or touches do not agree: touch there again, with "
        "shorter arms."
    )
    return [Doubt("misfit", words, _apart(table.origin[worst], extent))]


def _close_sheets(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Samples close to a patch that faces away from them, or toward them."""
    pool, limit = atlas.membership.pool, _CLOSE * atlas.tolerance
    _, which, found = claims(atlas)
    opposite = (found.numbers[:, 3:] * pool.normals[which]).sum(axis=1) < _OPPOSITE
    # Beyond its cell a polynomial may turn back to any place.
    close = opposite & found.own & (np.abs(found.distance) <= limit)
    places = pool.points[np.unique(which[close])]
    if not len(places):
        return []
    words = (
        f"Two sheets are less than {limit:.3g} apart, and the surface between them is not certain; "
        "give a smaller tolerance, or look there."
    )
    return [Doubt("close sheets", words, _apart(places, extent))]


def _lost_contact(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Ends of contours at which the surface is drawn to end."""
    count = len(atlas.rims)
    if not count:
        return []
    words = (
        f"The surface ends where {_count(count, 'contour', 'contours')} lost contact and nothing "
        "was met beyond; where the object goes on, the probe slipped: touch there again."
    )
    places = atlas.rims.unsure(atlas.tolerance)[0]
    if len(places):
        words += " The rim is not known to the tolerance everywhere."
    return [Doubt("lost contact", words, _apart(places, extent))]


def _topology(surface: Triangles | None, atlas: AtlasState) -> list[Doubt]:
    """Pieces, holes, closed or not, and an odd Euler characteristic of the triangles."""
    if surface is None or not len(surface.faces):
        return [Doubt("no surface", "Nowhere is the surface known.", _NOWHERE)]
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    found, size = [], _extent(surface.vertices)
    edges = np.concatenate([surface.faces[:, [0, 1]], surface.faces[:, [1, 2]]])
    links = coo_matrix((np.ones(len(edges)), edges.T), (len(surface.vertices),) * 2)
    pieces = int(connected_components(links, directed=False)[0])
    if pieces > 1:
        words = f"The surface has {pieces} pieces; touch between them, or check for a second body."
        found.append(Doubt("pieces", words, _NOWHERE))
    if closed := len(surface.closed_holes):
        words = (
            f"{_count(closed, 'small hole was', 'small holes were')} closed across without a "
            "sample; touch there."
        )
        found.append(Doubt("closed holes", words, _apart(surface.closed_holes, size)))
    rim = trimesh.grouping.group_rows(mesh.edges_sorted, require_count=1)
    if len(rim):
        middle = surface.vertices[mesh.edges_sorted[rim]].mean(axis=1)
        middle = middle[~atlas.rims.at(middle, atlas.tolerance)]
        words = "The surface is not closed; touch at the rims, unless the object is open there."
        if len(middle):
            found.append(Doubt("holes", words, _apart(middle, size)))
    elif not mesh.is_watertight or mesh.euler_number % 2:
        words = (
            f"The triangles do not make a closed surface (Euler characteristic {mesh.euler_number}"
            "); extract it with a shorter edge."
        )
        found.append(Doubt("topology", words, _NOWHERE))
    return found
