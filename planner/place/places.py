"""Places: points of the surface with what is known there, kept from touch to touch.

Each patch has places just beyond its outline, which are open where neither a patch nor a face knows
the surface, and places in its cell, each with a predicted deviation and a share of the area.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.field.blend import Blend
from touchatlas.atlas.field.predicted_deviation import predicted_deviation
from touchatlas.atlas.graph.outlines import COUNT, core_points
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.known_surface import blend_of_patches, deviations, whole_field
from touchatlas.atlas.patches.growing_array import grown
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner.place.deviation_ratio import DeviationRatio

# Distance of an open place from the origin, in distances of the outline, where the patch itself no
# longer knows the surface: narrow gaps beside an outline need no patch; and the distance at which
# it is touched, as a fraction of that. Doubled excess: places are asked about that need no patch.
_BEYOND, _TOUCHED = 1.35, 0.7
# Largest distance from the blended surface of a point that is known, in patch radii: a patch whose
# own prediction is farther off is wrong there. Doubled, more of such places pass for known.
_OFF = 0.25
# Distance between places that are listed at the end, in extents. Doubled, fewer places are named.
_LISTED = 0.1
# Places of a core, and their distances from its centre, in core radii, and directions, rad: points
# of a spiral, each of which stands for the same area. The angle between two is the golden angle.
# Doubled, the area of a cell is known to 2 % instead of 5 %, and planning takes longer.
_INNER = 21
_RADII = np.sqrt((np.arange(_INNER) + 0.5) / _INNER)
_TOWARD = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_INNER)


@dataclass(frozen=True, eq=False)
class Known:
    """Known places: 45 for each of m patches, or any n.

    The first 21 of a patch are in its cell, the others beyond its outline, where faces say what no
    patch knows.

    Parameters
    ----------
    points, normals : (m, 45, 3) or (n, 3) float, length; unit, world
        Feet on the blended surface.
    deviation : (m, 45) or (n,) float, length
    area : (m, 45) or (n,) float, length^2
        Area that the place stands for; 0 where another patch owns it, or no face is known.
    """

    points: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    area: np.ndarray


def known_to(atlas: Atlas, limit: float) -> Callable[[np.ndarray], np.ndarray]:
    """A function from points (n, 3) to whether (n,) the surface is known there to a deviation: the
    points lie within three deviations of it, and its deviation is ``limit`` at most, length."""

    def known(points: np.ndarray) -> np.ndarray:
        found = atlas.blend(points)
        deviation = deviations(atlas, found)
        sure = found.known & (np.nan_to_num(deviation) <= limit)
        near: np.ndarray = np.abs(np.nan_to_num(found.distance)) <= 3.0 * limit
        return sure & near

    return known


class Places:
    """The places of all patches of an atlas.

    Notes
    -----
    ``update`` computes the places of patches that changed, so its time does not grow with the
    atlas.
    """

    def __init__(self) -> None:
        self._open = np.zeros((0, COUNT), bool)
        self._edge = np.zeros((0, COUNT, 3))
        self._inner = np.zeros((0, _INNER + COUNT, 6))
        self._deviation, self._area = np.zeros((2, 0, _INNER + COUNT))
        self._touches = -1
        # Number of samples from which the faces were read that filled places; 0 without.
        self._filled_by = 0
        self.deviation_ratio = DeviationRatio()

    def update(self, atlas: Atlas, stale: Iterable[int], touches: int) -> None:
        """Compute the places of patches ``stale`` and of their neighbours again.

        Parameters
        ----------
        atlas : Atlas
        stale : iterable of int
            Patches that changed since the last update.
        touches : int
            Touches since then. If the atlas learned others, all places are computed.
        """
        size = atlas.table.size
        for name in ("_open", "_edge", "_inner", "_deviation", "_area"):
            setattr(self, name, grown(getattr(self, name), size))
        rows = atlas.table.rows
        law = atlas.known_law
        filled_by = 0 if law.beside is None else law.count
        same = filled_by == self._filled_by and self._touches >= 0
        if same and atlas.touches - self._touches == touches:
            near = atlas.neighbours.around(row for row in stale if atlas.table.alive[row])
            rows = np.array(sorted(near), int)
        self._touches, self._filled_by = atlas.touches, filled_by
        if len(rows):
            self._update(atlas, rows)

    def _update(self, atlas: Atlas, rows) -> None:
        """Places just beyond the outlines and in the cells of rows (m,), in one blend."""
        outlines = atlas.surface_graph.outlines.points(rows)
        is_open = atlas.surface_graph.outlines.open(rows)
        inside, cells = _places_in_cells(atlas, rows)
        origin = atlas.table.origin[rows]
        which, place = np.nonzero(is_open)
        beyond = origin[which] + _BEYOND * (outlines[which, place] - origin[which])
        found = blend_of_patches(atlas, np.concatenate([inside[cells], beyond]), curved=False)
        count = len(cells[0])
        bare = _is_bare(atlas, rows[which], beyond, found.some(slice(count, None)))
        which, place, beyond = which[bare], place[bare], beyond[bare]
        filled, values = _filled(atlas, rows[which], beyond)
        is_open[:] = False
        is_open[which[~filled], place[~filled]] = True
        self._open[rows] = is_open
        self._edge[rows] = origin[:, None] + _TOUCHED * _BEYOND * (outlines - origin[:, None])
        inner = np.zeros((len(rows), _INNER + COUNT, 8))
        inner[cells] = _known_at(atlas, rows[cells[0]], inside[cells], found.some(slice(count)))
        inner[which[filled], _INNER + place[filled]] = values
        inner = np.where(inner[..., 7:] > 0.0, inner, 0.0)
        self._inner[rows], self._deviation[rows] = inner[..., :6], inner[..., 6]
        self._area[rows] = inner[..., 7]

    def open(self, rows) -> tuple[np.ndarray, np.ndarray]:
        """Open places (k, 3) of rows (m,), where a touch may begin, and the patch (k,) of each."""
        which, place = np.nonzero(self._open[rows])
        return self._edge[rows[which], place], rows[which]

    def known(self, rows) -> Known:
        """The known places of rows (m,)."""
        inner = self._inner[rows]
        return Known(inner[..., :3], inner[..., 3:], *self.deviations(rows))

    def deviations(self, rows) -> tuple[np.ndarray, np.ndarray]:
        """Deviations and areas (m, 45) of the same places."""
        return self._deviation[rows], self._area[rows]

    def areas(
        self,
        atlas: Atlas,
        is_untried: Callable[[np.ndarray], np.ndarray],
        tolerance: float | None = None,
    ) -> tuple[float, float, float]:
        """Expected area within the tolerance of the atlas or the given one, all area, and the
        first by predicted deviations alone, length^2.

        ``is_untried`` tells of points (n, 3) whether (n,) they are away from touches and attempts.
        An open place that was tried is no surface that is left: there a patch runs on beyond an
        edge or a thin wall.

        The chance that a place is within it follows from its deviation and from what new samples
        told of such (``DeviationRatio.within``). An open place stands for a 24th of the core of its
        patch, of which nothing is known.
        """
        rows = atlas.table.rows
        deviation, area = self.deviations(rows)
        some = area > 0.0
        with np.errstate(divide="ignore"):
            limit = (atlas.tolerance if tolerance is None else tolerance) / deviation[some]
        within, unscaled = np.zeros((2, *area.shape))
        within[some] = self.deviation_ratio.within(limit)
        unscaled[some] = erf(limit / np.sqrt(2.0))
        inside = float((area * within).sum())
        points, homes = self.open(rows)
        is_open = float(self.open_area(atlas, homes[is_untried(points)]).sum())
        total = float(area.sum()) + is_open
        return inside, total, float((area * unscaled).sum())

    def open_area(self, atlas: Atlas, homes) -> np.ndarray:
        """(k,) area that open places of patches (k,) stand for, length^2."""
        share: np.ndarray = np.pi / COUNT * atlas.table.weight[homes]
        return share

    def left(self, atlas: Atlas, extent: float) -> np.ndarray:
        """(k, 3) places that are open or not known to the tolerance, far apart from each other."""
        rows = atlas.table.rows
        known = self.known(rows)
        deviation = self.deviation_ratio.value * known.deviation
        weak = (known.area > 0.0) & (SURE * deviation > atlas.tolerance)
        found = np.concatenate([self.open(rows)[0], known.points[weak]])
        return apart_from_each_other(found, extent)


def apart_from_each_other(points, extent: float) -> np.ndarray:
    """(k, 3) the first of points (n, 3) that are far from each other."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(((point - other) ** 2).sum() > (_LISTED * extent) ** 2 for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)


def _places_in_cells(atlas: Atlas, rows) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Places (m, 21, 3) in the cores of rows (m,), length, world, and the indices of those in their
    cells. They lie on the patches: beside the surface polynomials are less sure."""
    table = atlas.table
    points = core_points(table, rows, _RADII, _TOWARD)
    others = power_at(table, atlas.neighbours.lines_of(rows)[:, None], points).min(axis=2)
    # Cells of the field overlap by a margin. Each area is counted once.
    return points, np.nonzero(power_at(table, rows[:, None, None], points)[..., 0] <= others)


def _is_bare(atlas: Atlas, home, points, found: Blend) -> np.ndarray:
    """(n,) whether no patch knows the surface at points (n, 3) beyond the outlines of patches
    ``home`` (n,), by the blend there."""
    radius = atlas.table.radius[home]
    bare = ~found.known | (np.abs(np.nan_to_num(found.distance)) > _OFF * radius)
    bare &= ~atlas.rims.beyond(points, atlas.table.axes[home, 2])
    return np.asarray(bare)


def _filled(atlas: Atlas, home, points) -> tuple[np.ndarray, np.ndarray]:
    """Whether (n,) faces say what no patch knows at points (n, 3) beyond the outlines of patches
    ``home`` (n,); and feet, normals, deviations and areas (m, 8) of those."""
    gaps = whole_field(atlas).gaps
    filled = np.zeros(len(points), bool)
    if gaps is None or not len(points):
        return filled, np.zeros((0, 8))
    which, distance, deviation, normal, _, _ = gaps.at(points)
    filled[which] = True
    feet = points[which] - distance[:, None] * normal
    area = np.pi / COUNT * atlas.table.weight[home[which]]
    return filled, np.column_stack([feet, normal, deviation, area])


def _known_at(atlas: Atlas, home, points, found: Blend) -> np.ndarray:
    """(n, 8) feet, normals, deviations and areas at points (n, 3) in the cells of patches ``home``
    (n,), by the blend there: see ``Known``."""
    feet = points - found.distance[:, None] * found.normal
    deviation, known = predicted_deviation(atlas.table, found), found.known
    area = known * np.pi / _INNER * atlas.table.weight[home]
    return np.column_stack([feet, found.normal, deviation, area])
