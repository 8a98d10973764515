"""Touch: everything one visit of the probe brought back."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from touchatlas.patch.arrays import check_unit, frozen_array
from touchatlas.patch.contour import Contour


class TouchStatus(Enum):
    """What became of a probe plan."""

    TOUCHED = "touched"
    NO_CONTACT = "no contact"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, eq=False)
class Touch:
    """The contours tracked around one point of contact.

    Parameters
    ----------
    number : int
        Number of the ProbePlan that was carried out.
    contact : (3,) float, length, world
        Where the probe met the surface, as measured; the planned reference point
        when it met none.
    approach : (3,) float, unit, world
        From the surface toward where the probe came from: an outward direction.
    contours : tuple of Contour
        Empty unless ``status`` is TOUCHED.
    status : TouchStatus
    tracked_length, travel_length : float, length
        Path in contact, and path in the air to get there.
    """

    number: int
    contact: np.ndarray
    approach: np.ndarray
    contours: tuple[Contour, ...]
    status: TouchStatus
    tracked_length: float
    travel_length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "contact", frozen_array(self.contact, (3,), "contact"))
        object.__setattr__(self, "approach", check_unit(self.approach, "approach"))
        object.__setattr__(self, "contours", tuple(self.contours))
