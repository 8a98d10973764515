"""Choose: what the choice of a place depends on, and what is chosen."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.probe_plan import Reason

# Places within this fraction of the extent of an earlier touch or attempt are not touched again, so
# that every exploration ends. Doubled, fewer places in narrow features are touched.
APART = 0.02
# The same for holes of the surface at the end. Doubled, some holes remain.
APART_HOLES = 0.005
# Share of the distance to a pending plan that counts: its arms will teach what is about it, so that
# other arms go ten times as far away. Doubled, several arms touch nearer to each other.
_PENDING = 0.1
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
    ratio : float
        By what predicted deviations are multiplied: see ``DeviationRatio.value``.
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
    ratio: float
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
        return self.apart(points) > APART * self.extent

    def is_untried(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches and attempts."""
        return distance_to(self.done, points) > APART * self.extent


@dataclass(frozen=True, eq=False)
class Target:
    """A place to touch.

    Parameters
    ----------
    point : (3,) float, length, world
    normal : (3,) float, unit, world
        Predicted outward normal.
    reason : Reason
    """

    point: np.ndarray
    normal: np.ndarray
    reason: Reason


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
