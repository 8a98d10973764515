"""Curves of recorded points, of one unit, without repeats, with what their vectors are."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from touchatlas.patch.geometry.arrays import has_powers
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.patch.words import count_of
from touchatlas.sim.recorded.vectors import what_vectors_are
from touchatlas.sim.world.units import UNIT_NAMES, UNITS


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve of a file, or its scattered points.

    Parameters
    ----------
    name : str
        "" where the points are scattered: single contacts, or a cloud.
    points : (n, 3) float, length
        In order of travel, unless they are scattered.
    normal : (3,) float, unit, optional
        Of its sampling plane, where the file holds it.
    outward : (n, 3) float, unit, optional
        Out of the body at each point, where the file holds it.
    exact : bool
        Whether ``outward`` are the normals of the surface, and not only its side, as a direction
        of approach is.
    """

    name: str
    points: np.ndarray
    normal: np.ndarray | None
    outward: np.ndarray | None = None
    exact: bool = False


@dataclass(frozen=True)
class ReadOptions:
    """What a user says about a file that it does not say itself.

    Parameters
    ----------
    columns : str
        As ``x=3,y=4,z=5,curve=1``: numbers of columns, from 1, or their names.
    unit : str
        Of the lengths; where it is empty the file's own is taken.
    tip_radius : float, length
        Of the ball whose centres the points are; 0 where they are contacts. For the fit of a patch
        points with normals of the surface are moved inward by it as they are read.
    systematic_std : float, length
        Standard deviation of the error that all points share: of the radius, of the stiffness.
    gap : float
        A curve ends where the next point is as many steps away, in space or in time, of those
        that three in four are shorter than; where nothing else parts curves.
    tip : str
        Path of a probe.toml: recordings with forces are read as arms in contact, less its tip;
        ``with_tip`` says what it means for other files.
    """

    columns: str = ""
    unit: str = ""
    tip_radius: float = 0.0
    systematic_std: float = 0.0
    gap: float = 6.0
    tip: str = ""

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            raise ValueError(f"there is no unit {self.unit!r}; give {UNIT_NAMES}")
        for name in ("tip_radius", "systematic_std"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"{name} is {getattr(self, name)}; give a length >= 0")
        if not self.gap > 1.0:
            raise ValueError(f"gap is {self.gap}; give a number of steps above 1")


class Curves(NamedTuple):
    """Curves of a file in order of appearance, whether points were repeated, how it was read, in
    phrases, what is probably wrong with it, in sentences, and the unit of its lengths."""

    curves: list[Curve]
    repeated: bool
    assumed: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    unit: str = ""

    @property
    def how(self) -> str:
        """How the file was read, in one line."""
        return "; ".join(self.assumed)


def checked(path: Path, groups, unit: str, options: ReadOptions, assumed, warnings) -> Curves:
    """Curves of groups of points; refused, with how they were read, where they are none."""
    unit = UNITS[options.unit] if options.unit else unit
    groups = [(name, points, _unit_vectors(vectors)) for name, points, vectors in groups]
    kind = what_vectors_are(groups)
    if options.tip_radius and kind == "normals" and _all_known(groups):
        off = options.tip_radius
        groups = [(name, points - off * vectors, vectors) for name, points, vectors in groups]
        assumed = [*assumed, f"a tip of radius {off:g} was taken off along the normals"]
    everything = np.concatenate([np.zeros((0, 3)), *(points for _, points, _ in groups)])
    count = len({name for name, *_ in groups} - {""})
    many = count_of(count, "curve") if count else "no curve"
    points = count_of(len(everything), "point")
    assumed = [*assumed, f"{points} of {many}, in {unit or 'a unit not named'}"]
    how = f"{path.name} was read so: {'; '.join(assumed)}"
    if not len(everything):
        raise ValueError(f"{path} has no points; {how}")
    check_size(path, everything)
    if len(everything) > 1 and not np.ptp(everything, axis=0).any():
        raise ValueError(f"{path} has one point only, all others repeat it; record curves; {how}")
    curves: list[Curve] = []
    repeated = False
    for name, points, vectors in groups:
        keep = _without_repeats(points, bool(name))
        repeated |= len(keep) < len(points)
        given = bool(np.isfinite(vectors).any())
        plane = next(v for v in vectors if np.isfinite(v).all()) if given else None
        if kind == "planes":
            curves.append(Curve(name, points[keep], plane))
        else:
            outward = vectors[keep] if given else None
            curves.append(Curve(name, points[keep], None, outward, given and kind == "normals"))
    if any(np.isfinite(vectors).any() for *_, vectors in groups):
        assumed.append(f"the vectors are {_KINDS[kind]}")
    curves = _once(curves, warnings)
    return Curves(curves, repeated, tuple(assumed), tuple(warnings), unit)


def check_size(path: Path, points) -> None:
    """Refuse points (n, 3) whose size double precision can't take powers of."""
    # Half of each, so that no difference overflows.
    span = 2.0 * float(np.ptp(0.5 * points, axis=0).max()) if len(points) else 0.0
    if span and not has_powers(span, np.abs(points).max()):
        raise ValueError(
            f"{path} has points that span {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )


def _all_known(groups) -> bool:
    """Whether each point has its vector."""
    return all(np.isfinite(vectors).all() for *_, vectors in groups)


_KINDS = {
    "planes": "normals of the planes in which the curves lie",
    "normals": "normals of the surface, outward",
    "sides": "directions of approach, outward: they tell the outer side",
}


def _unit_vectors(vectors) -> np.ndarray:
    """(n, 3) vectors of length one, NaN where they are zero or not given."""
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore"):
        return vectors / np.where(length > 0.0, length, np.nan)


def _without_repeats(points, closed: bool) -> np.ndarray:
    """Places of the points of a curve, each once; the last too where it closes a loop."""
    keep = np.sort(np.unique(points, axis=0, return_index=True)[1])
    if closed and len(keep) > LEAST_POINTS and (points[0] == points[-1]).all():
        keep = np.append(keep, len(points) - 1)
    return keep


def _once(curves: list[Curve], warnings: list[str]) -> list[Curve]:
    """Curves without the points that an earlier one holds, where these are most of the points.

    Two curves share the point where they cross. A contour that was written twice shares all.
    """
    everything = np.concatenate([curve.points for curve in curves])
    index = np.unique(everything, axis=0, return_inverse=True)[1].ravel()
    owner = np.full(index.max() + 1, -1)
    kept: list[Curve] = []
    start = 0
    for k, curve in enumerate(curves):
        mine = index[start : start + len(curve.points)]
        start += len(curve.points)
        others = owner[mine][owner[mine] >= 0]
        most = int(np.bincount(others).argmax()) if len(others) else -1
        again = (owner[mine] == most) & (most >= 0)
        owner[mine[owner[mine] < 0]] = k
        if curve.name and most >= 0 and curves[most].name and 2 * again.sum() > len(mine):
            warnings.append(
                f"curve {curve.name!r} repeats {count_of(again.sum(), 'point')} of curve "
                f"{curves[most].name!r}; each was counted once"
            )
            outward = None if curve.outward is None else curve.outward[~again]
            kept.append(replace(curve, points=curve.points[~again], outward=outward))
        else:
            kept.append(curve)
    return [curve for curve in kept if len(curve.points)]
