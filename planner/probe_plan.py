"""ProbePlan: where to touch next, and how."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from touchatlas.patch.geometry.arrays import check_unit, frozen_array
from touchatlas.patch.geometry.contour import SamplingPlane


class Reason(Enum):
    """Why a place was chosen."""

    START = "start"
    EXPAND = "expand"
    REFINE = "refine"
    CLOSE_GAP = "close gap"


@dataclass(frozen=True, eq=False)
class ProbePlan:
    """One visit of the probe.

    Move toward ``reference_point`` against ``normal`` until contact, then track the
    surface in each plane, both ways from the contact.

    Parameters
    ----------
    number : int
        Counts the plans of one planner, from 0.
    reference_point : (3,) float, length, world
        Predicted point of contact.
    normal : (3,) float, unit, world
        Predicted outward normal.
    planes : tuple of SamplingPlane
        Each contains the reference point.
    reach : float, length
        How far to track from the contact each way, along the curve.
    step : float, length
        Arc length between samples.
    max_turn : float, rad
        Stop where the curve has turned by more than this from its direction at the contact.
    reason : Reason
    """

    number: int
    reference_point: np.ndarray
    normal: np.ndarray
    planes: tuple[SamplingPlane, ...]
    reach: float
    step: float
    max_turn: float
    reason: Reason

    def __post_init__(self) -> None:
        point = frozen_array(self.reference_point, (3,), "reference point")
        object.__setattr__(self, "reference_point", point)
        object.__setattr__(self, "normal", check_unit(self.normal, "plan normal"))
        if not 0 < self.step <= self.reach:
            raise ValueError(f"step is {self.step} and reach {self.reach}; need 0 < step <= reach")
