"""What a probe reports: a contour, its sampling plane, and why tracking stopped at either end."""

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from touchatlas.patch.geometry.arrays import (
    check_length,
    check_points,
    check_unit,
    check_units,
    frozen_array,
)
from touchatlas.patch.words import count_of


class ContourEnd(Enum):
    """Why tracking stopped at one end of a contour."""

    LENGTH_REACHED = "length reached"
    CLOSED_LOOP = "closed loop"
    TURNED_AWAY = "turned away"
    EDGE = "edge"
    LOST_CONTACT = "lost contact"
    UNREACHABLE = "unreachable"
    OVERLOAD = "overload"


@dataclass(frozen=True, eq=False)
class SamplingPlane:
    """The plane that a probe stays in while it tracks one contour.

    Parameters
    ----------
    point : (3,) float, length, world
        A point of the plane.
    normal : (3,) float, unit, world
        Perpendicular to the plane.
    """

    point: np.ndarray
    normal: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen_array(self.point, (3,), "plane point"))
        object.__setattr__(self, "normal", check_unit(self.normal, "plane normal"))


@dataclass(frozen=True, eq=False)
class Contour:
    """Points tracked along a curve, in a sampling plane or beside it.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel. At least half of them are near the plane. A point that repeats the one
        before is left out: the probe stood still and measured nothing new.
    plane : SamplingPlane
    noise_std : float, length, >= 0
        Standard deviation of each coordinate of each point.
    ends : pair of ContourEnd
        Why tracking stopped before the first point and after the last one.
    normals : (n, 3) float, unit, world, optional
        Outward normal of the surface at each point, as a probe measures it: its force, without
        the friction. A ball in the plane touches the surface beside the plane, so points with
        normals are learned where they are, and others are moved into the plane.
    """

    points: np.ndarray
    plane: SamplingPlane
    noise_std: float
    ends: tuple[ContourEnd, ContourEnd]
    normals: np.ndarray | None = None

    def __post_init__(self) -> None:
        points = check_points(self.points, "contour points")
        new = np.append(True, (points[1:] != points[:-1]).any(axis=1))
        object.__setattr__(self, "points", _rows(points, new))
        if self.normals is not None:
            normals = check_units(self.normals, len(points), "contour normals")
            object.__setattr__(self, "normals", _rows(normals, new))
        check_length(self.noise_std, "noise_std")
        if not isinstance(self.plane, SamplingPlane):
            raise ValueError(f"plane is {self.plane!r}; it must be a SamplingPlane")
        pair = isinstance(self.ends, tuple | list) and len(self.ends) == 2
        if not (pair and all(isinstance(end, ContourEnd) for end in self.ends)):
            raise ValueError(f"ends are {self.ends!r}; they must be a pair of ContourEnd")
        self._check_in_plane()

    def __repr__(self) -> str:
        """One line."""
        long = float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())
        ends = ", ".join(end.value for end in self.ends)
        return f"<Contour: {count_of(len(self.points), 'point')}, {long:.4g} long, ends: {ends}>"

    def _check_in_plane(self) -> None:
        """Refuse points that belong to another plane or frame.

        Medians ignore single bad contacts, which are not the caller's mistake: the fit finds them.
        """
        height = (self.points - self.plane.point) @ self.plane.normal
        if self.normals is not None:
            # Contacts of a ball whose centre stays in a plane are off it by -r n . w.
            lean = np.stack([self.normals @ self.plane.normal, np.ones(len(height))], axis=1)
            fit = np.linalg.lstsq(lean, height, rcond=None)[0]
            height = height - lean @ fit if fit[0] < 0.0 else height
        off = float(np.median(np.abs(height)))
        from_middle = self.points - np.median(self.points, axis=0)
        size = float(np.median(np.sqrt((from_middle * from_middle).sum(axis=1))))
        # The sine of 30 degrees: a curve at a wider angle is nearer to the next of three planes 60
        # degrees apart. A median of noise alone is 0.67 deviations.
        rounding = 1e-12 * max(np.abs(self.points).max(), np.abs(self.plane.point).max())
        if off > max(0.5 * size, 5.0 * self.noise_std) + rounding:
            raise ValueError(
                f"half of the contour points are {off:.4g} or more off their sampling plane, but "
                f"no more than {size:.4g} from their middle; give the plane that they were tracked "
                "in, in the same frame and unit"
            )

    def learned_points(self, tip_radius: float = 0.0) -> np.ndarray:
        """(n, 3) points as an atlas learns them, length, world: where they are, if they have
        normals or are centres of a tip, else in the plane, where a distance from it is noise."""
        is_in_plane = self.normals is None and not tip_radius
        return self.points_in_plane if is_in_plane else self.points

    def only(self, some) -> "Contour":
        """The contour of some of its points (k,), with their normals."""
        normals = None if self.normals is None else self.normals[some]
        return replace(self, points=self.points[some], normals=normals)

    @cached_property
    def points_in_plane(self) -> np.ndarray:
        """(n, 3) points moved into the plane, length, world, for what needs a plane curve.

        A point with a normal is moved in its tangent plane, so that it stays on the surface; along
        the normal of the plane where it has none, or a tangent plane within 13 degrees of the
        plane.
        """
        off, across = (self.points - self.plane.point) @ self.plane.normal, self.plane.normal
        if self.normals is None:
            return self.points - off[:, None] * across
        along = across - (self.normals @ across)[:, None] * self.normals
        square = (along * along).sum(axis=1)
        steep = square > 0.05
        way = np.where(steep[:, None], along / np.where(steep, square, 1.0)[:, None], across)
        return np.asarray(self.points - off[:, None] * way)


def check_contours(contours) -> None:
    """ValueError for anything but a tuple or list of Contour."""
    several = contours if isinstance(contours, tuple | list) else [contours]
    others = [one for one in several if not isinstance(one, Contour)]
    if others or several is not contours:
        got = (others or several)[0]
        raise ValueError(
            f"got {type(got).__name__} among the contours or for them; give a tuple of three or "
            "more Contour(points, plane, noise_std, ends)"
        )


def _rows(values: np.ndarray, some) -> np.ndarray:
    """Read-only rows (k, 3) of values (n, 3), those that are true in ``some`` (n,)."""
    if some.all():
        return values
    values = values[some]
    values.flags.writeable = False
    return values
