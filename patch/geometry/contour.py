"""What a probe reports: sampling planes, contours and why each contour ended."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from touchatlas.patch.geometry.arrays import check_points, check_unit, frozen_array, real

# Half the points of a contour may be farther from its plane than this share of how far half of
# them are from their middle: the sine of 30 degrees. A straight curve that runs at a wider angle
# is nearer to the next of three planes, 60 degrees apart.
_ASTRAY = 0.5
# Or than this many deviations of the noise, or this share of the coordinates: their rounding.
_NOISE, _ROUNDING = 5.0, 1e-12


class ContourEnd(Enum):
    """Why tracking stopped at one end of a contour."""

    LENGTH_REACHED = "length reached"
    CLOSED_LOOP = "closed loop"
    TURNED_AWAY = "turned away"
    EDGE = "edge"
    LOST_CONTACT = "lost contact"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, eq=False)
class SamplingPlane:
    """The plane that a probe stays in while it tracks one contour.

    Parameters
    ----------
    point : (3,) float, length, world
        A point of the plane.
    normal : (3,) float, unit, world
        Across the plane.
    """

    point: np.ndarray
    normal: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen_array(self.point, (3,), "plane point"))
        object.__setattr__(self, "normal", check_unit(self.normal, "plane normal"))


@dataclass(frozen=True, eq=False)
class Contour:
    """Points tracked along the curve where a sampling plane meets the surface.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel, near the plane: half of them at least.
    plane : SamplingPlane
    noise_std : float, length, >= 0
        Standard deviation of each coordinate of each point.
    ends : pair of ContourEnd
        Why tracking stopped before the first point and after the last one.
    """

    points: np.ndarray
    plane: SamplingPlane
    noise_std: float
    ends: tuple[ContourEnd, ContourEnd]

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", check_points(self.points, "contour points"))
        if not 0.0 <= real(self.noise_std) < np.inf:
            raise ValueError(f"noise_std is {self.noise_std}; it must be a length >= 0")
        if not isinstance(self.plane, SamplingPlane):
            raise ValueError(f"plane is {self.plane!r}; it must be a SamplingPlane")
        pair = isinstance(self.ends, tuple | list) and len(self.ends) == 2
        if not (pair and all(isinstance(end, ContourEnd) for end in self.ends)):
            raise ValueError(f"ends are {self.ends!r}; they must be a pair of ContourEnd")
        self._check_in_plane()

    def _check_in_plane(self) -> None:
        """Refuse the points of another plane, or of another frame. Medians are taken: single bad
        contacts are the world's, and the fit finds them."""
        offset = self.points - self.plane.point
        off = float(np.median(np.abs(offset @ self.plane.normal)))
        from_middle = self.points - np.median(self.points, axis=0)
        size = float(np.median(np.sqrt((from_middle * from_middle).sum(axis=1))))
        rounding = _ROUNDING * max(np.abs(self.points).max(), np.abs(self.plane.point).max())
        if off > max(_ASTRAY * size, _NOISE * self.noise_std) + rounding:
            raise ValueError(
                f"half of the contour points are {off:.4g} or more off their sampling plane, but "
                f"no more than {size:.4g} from their middle; give the plane that they were tracked "
                "in, in the same frame and unit"
            )

    @cached_property
    def points_in_plane(self) -> np.ndarray:
        """(n, 3) points moved across the plane into it: off its plane a sample tells nothing,
        since it was tracked in it. Length, world."""
        off = (self.points - self.plane.point) @ self.plane.normal
        return self.points - off[:, None] * self.plane.normal
