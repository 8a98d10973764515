"""Choose: the place of the next touch, from the places of all patches."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.place.places import Known, Places
from touchatlas.planner.probe_plan import Reason

# Places within this fraction of the extent of an earlier touch or attempt are not touched again, so
# that every exploration ends. Doubled, fewer places in narrow features are touched.
_APART = 0.02
# The same for holes of the surface at the end. Doubled, some holes remain.
APART_HOLES = 0.005
# Distance ahead of a lost end at which a contact shows that it was a slip, in spacings of its
# samples: two at most. Halved, the error of the end itself decides.
_AHEAD = 1.5
# Share of the distance to a pending plan that counts: its arms will teach what is about it, so that
# other arms go ten times as far away. Doubled, several arms touch nearer to each other.
_PENDING = 0.1
# Cost of a touch besides the way to it, in extents. With the way, 15 explorations of five bodies
# tracked and travelled 5 % less. Doubled, touches jump farther.
_SET_UP = 0.3
# Deviation of a place that needs no touch, in deviations of a sample: a dozen samples give it.
# Doubled, explorations to tolerances near the noise end too early.
SUREST = 0.3
# Patches whose places are looked at together. Doubled, planning takes about as long.
_AT_ONCE = 16
# Places of a first touch: points of a spiral about the start, in extents, and their number. The
# angle between two is the golden angle, which leaves no direction out. Doubled, the spiral is
# twice as wide.
_SPIRAL, _STARTS = 0.5, 24
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class View:
    """What the choice of a place depends on.

    Parameters
    ----------
    atlas : Atlas
    places : Places
        Those of all patches, up to date.
    touched : (n, 3) float, length, world
        Reference points of the pending plans, and contacts of the touches, the last one last.
    done : (m, 3) float, length, world
        The contacts and the reference points of all attempts.
    in_vain : (l, 3) float, length, world
        The reference points of the attempts that met nothing.
    pending : (k, 3) float, length, world
        Reference points of the plans that are not answered yet.
    extent : float, length
        Diagonal of the bounding box of all samples.
    """

    atlas: Atlas
    places: Places
    touched: np.ndarray
    done: np.ndarray
    in_vain: np.ndarray
    pending: np.ndarray
    extent: float

    def apart(self, points) -> np.ndarray:
        """(n,) distance of points (n, 3) to the nearest touch or attempt, length; a share of that
        to the nearest pending plan, where that is less."""
        return np.minimum(
            distance_to(self.done, points), _PENDING * distance_to(self.pending, points)
        )

    def is_free(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches, attempts and pending plans."""
        return self.apart(points) > _APART * self.extent

    def is_untried(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches and attempts."""
        return distance_to(self.done, points) > _APART * self.extent


@dataclass(frozen=True, eq=False)
class Target:
    """A place to touch.

    Parameters
    ----------
    point : (3,) float, length, world
    normal : (3,) float, unit, world
        Predicted outward normal.
    reason : Reason
    across : (3,) float, unit, world, optional
        Normal of the one plane in which a whole section is tracked; without, several planes.
    """

    point: np.ndarray
    normal: np.ndarray
    reason: Reason
    across: np.ndarray | None = None


def start_targets(start, outward) -> Iterator[np.ndarray]:
    """Offsets (3,) of the first touch and of the next attempts from the start point, in extents:
    a spiral across the direction of approach."""
    e1 = any_tangent(outward)
    e2 = np.cross(outward, e1)
    for k in range(_STARTS):
        radius, angle = _SPIRAL * np.sqrt(k / _STARTS), _GOLDEN * k
        yield radius * (np.cos(angle) * e1 + np.sin(angle) * e2)


def distance_to(others, points) -> np.ndarray:
    """(n,) distance of points (n, 3) to the nearest of others (m, 3), length; infinite for none."""
    if not len(others):
        return np.full(len(points), np.inf)
    out: np.ndarray = cKDTree(others).query(points)[0]
    return out


def open_target(view: View) -> Target | None:
    """The open place that teaches most for its cost: the square of its distance to all touches, and
    attempts in vain, over the way from the last touch; None where all are near touches or attempts.

    What lies about an attempt in vain comes last: more places of the same patch would miss, too.
    """
    points, homes = open_places(view)
    if not len(points):
        return None
    best = best_open(view, points)
    return at_open(view, points[best], homes[best])


def best_open(view: View, points) -> int:
    """Which of open places (k, 3) teaches most for its cost: see ``open_target``."""
    reached = np.concatenate([view.touched, view.in_vain])
    away, offset = distance_to(reached, points), points - view.touched[-1]
    travel = np.sqrt((offset * offset).sum(axis=1))
    return int((away**2 / (_SET_UP * view.extent + travel)).argmax())


def open_places(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Open places (k, 3) away from touches and attempts, and the patch (k,) of each."""
    points, homes = view.places.open(view.atlas.table.rows)
    free = view.is_free(points)
    return points[free], homes[free]


def at_open(view: View, point, home: int) -> Target:
    """The target at an open place (3,) of patch ``home``."""
    found = blend_of_patches(view.atlas, point[None], curved=False)
    normal = found.normal[0] if found.known[0] else view.atlas.table.axes[home, 2]
    return Target(point, normal, Reason.EXPAND)


def weak_target(view: View) -> Target | None:
    """The place of largest predicted deviation, of the patch from which a touch can take most.

    What a touch can take is the integral of the variance; None where all places are near touches
    or attempts, or much surer than a single sample.
    """
    table = view.atlas.table
    rows, noise = table.rows, table.measurement_std[table.rows][:, None]
    deviation, area = view.places.deviations(rows)
    gain = area * np.maximum(deviation**2 - (SUREST * noise) ** 2, 0.0)
    score = gain.sum(axis=1)
    order = np.argsort(-score, kind="stable")[: np.count_nonzero(score > 0.0)]
    # A few patches at a time: the first of them with a free place is the one.
    for first in range(0, len(order), _AT_ONCE):
        some = order[first : first + _AT_ONCE]
        known = view.places.known(rows[some])
        free = view.is_free(known.points.reshape(-1, 3)).reshape(gain[some].shape)
        free &= gain[some] > 0.0
        if free.any():
            best = int(free.any(axis=1).argmax())
            place = int(np.where(free[best], known.deviation[best], 0.0).argmax())
            return Target(known.points[best, place], known.normals[best, place], Reason.REFINE)
    return None


def known_places(view: View) -> Known:
    """The n places of cells that are away from touches and attempts."""
    known = view.places.known(view.atlas.table.rows)
    some = known.area > 0.0
    some[some] = view.is_free(known.points[some])
    return Known(known.points[some], known.normals[some], known.deviation[some], known.area[some])


def slip_target(view: View) -> Target | None:
    """The place just ahead of an end at which contact was lost though the surface was met farther
    on: a contact there shows that the probe slipped. None where all were attempted."""
    ends = view.atlas.rims.ends
    doubtful = ends.facing_samples() if len(ends) else np.zeros(0, int)
    points = ends.points[doubtful] + _AHEAD * ends.steps[doubtful, None] * ends.tangents[doubtful]
    free = np.flatnonzero(view.apart(points) > APART_HOLES * view.extent)
    if not len(free):
        return None
    return Target(points[free[0]], ends.normals[doubtful[free[0]]], Reason.CLOSE_GAP)


def rim_target(view: View, limit: float) -> Target | None:
    """The place half-way between two ends of contours at a rim where the rim is least sure; None
    where none that is less sure than ``limit`` is left, length, but near touches or attempts."""
    points, normals, apart = view.atlas.rims.unsure(limit)
    apart = np.where(view.is_free(points), apart, 0.0)
    if not apart.max(initial=0.0) > 0.0:
        return None
    best = int(apart.argmax())
    return Target(points[best], normals[best], Reason.REFINE)
