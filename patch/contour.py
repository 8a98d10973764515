"""What a probe reports: sampling planes, contours and why each contour ended."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from touchatlas.patch.arrays import check_points, check_unit, frozen_array


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
        In order of travel.
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
        if not (np.isfinite(self.noise_std) and self.noise_std >= 0):
            raise ValueError(f"noise_std is {self.noise_std}; it must be a length >= 0")

    @cached_property
    def points_in_plane(self) -> np.ndarray:
        """(n, 3) points moved across the plane into it: off its plane a sample tells nothing,
        since it was tracked in it. Length, world."""
        off = (self.points - self.plane.point) @ self.plane.normal
        return self.points - off[:, None] * self.plane.normal
