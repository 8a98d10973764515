"""PlannerOptions: what a planner is asked for, and how it touches."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.patch.geometry.arrays import real
from touchatlas.planner.place.rules import RULES

# The planner by default.
TOLERANCE = "tolerance"


@dataclass(frozen=True)
class PlannerOptions:
    """What a planner is asked for, and how it touches.

    Parameters
    ----------
    name : str
        Which place is touched next: "tolerance", or for comparison "random", "farthest" or
        "variance".
    coverage : float
        Expected fraction of the surface within the tolerance at which it is known.
    curves : int
        Sampling planes per touch.
    reach : float
        Longest arm of a contour, in extents of what is touched so far.
    step : float
        Arc length between samples, in the same extents.
    step_turn : float, rad
        Turn from one sample to the next beyond which the step is halved, up to three times.
    max_turn : float, rad
        Largest angle by which a contour may turn from the contact to its end.
    search : int
        Approaches along rays past what is known, when nothing else is left, in search of other
        parts. Parts smaller than a fifth of the extent may be missed.
    pin_radius : float, length
        Radius of the straight pin that holds the tip and comes along the normal; none is 0. Where
        it would pass through what is known, no touch is planned.
    pin_length : float, length
        Length of the pin, more than its radius; given together with it.
    """

    name: str = TOLERANCE
    coverage: float = 0.995
    curves: int = 3
    reach: float = 0.6
    step: float = 0.014
    step_turn: float = np.pi / 12.0
    max_turn: float = 2.0 * np.pi / 3.0
    search: int = 0
    pin_radius: float = 0.0
    pin_length: float = 0.0

    def __post_init__(self) -> None:
        if self.name not in RULES:
            raise ValueError(f"the planner is {self.name!r}; it must be one of {', '.join(RULES)}")
        whole = isinstance(self.curves, int | np.integer) and not isinstance(self.curves, bool)
        if not (whole and 3 <= self.curves <= 36):
            raise ValueError(f"curves is {self.curves!r}; it must be a whole number from 3 to 36")
        whole = isinstance(self.search, int | np.integer) and not isinstance(self.search, bool)
        if not (whole and 0 <= self.search <= 1000):
            raise ValueError(f"search is {self.search!r}; it must be a whole number from 0 to 1000")
        for name in ("pin_radius", "pin_length"):
            if not 0.0 <= real(getattr(self, name)) < np.inf:
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must be a length >= 0")
        if not (
            self.pin_length == self.pin_radius == 0.0 or 0.0 < self.pin_radius < self.pin_length
        ):
            raise ValueError(
                f"pin_radius, pin_length are {self.pin_radius}, {self.pin_length}; give both, the "
                "length more than the radius"
            )
        limits = {"coverage": 1.0, "reach": 10.0, "step": 0.2}
        limits |= dict.fromkeys(("max_turn", "step_turn"), np.pi)
        for field in fields(self):
            value, most = getattr(self, field.name), limits.get(field.name)
            if most is not None and not 0.0 < real(value) < most:
                raise ValueError(
                    f"{field.name} is {value!r}; it must be greater than 0 and less than {most:.4g}"
                )
        if not 4.0 * self.step <= self.reach:
            raise ValueError(
                f"step, reach are {self.step}, {self.reach}; an arm must have four steps or more"
            )
