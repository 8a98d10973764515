"""CostModel: how many seconds a machine takes for a touch, and for the way to it."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.checks import check_above


@dataclass(frozen=True)
class CostModel:
    """Speeds and times of a machine, so that the planner weighs touches by seconds.

    Parameters
    ----------
    rapid : float, length/s
        Speed in air between touches. With 0 touches are weighed by their ways, and a touch itself
        by the level ``set_up``.
    approach : float, length/s
        Toward the surface; nothing is counted for it with 0.
    feed : float, length/s
        Along the surface; 0 of a probe that triggers.
    touch : float, s
        For a touch besides: to turn, to settle, to retract.
    point : float, s
        For a single point, of a probe that triggers.
    points : int
        Of each arm of a contour, of a probe that triggers.
    """

    rapid: float = 0.0
    approach: float = 0.0
    feed: float = 0.0
    touch: float = 0.0
    point: float = 0.0
    points: int = 0

    def __post_init__(self) -> None:
        check_above(self)
        if not isinstance(self.points, int | np.integer):
            raise ValueError(f"points is {self.points!r}; it must be a whole number")

    def seconds(self, travel, height: float, reach: float, curves: int) -> np.ndarray:
        """(n,) seconds of touches after ways in air.

        Parameters
        ----------
        travel : (n,) float, length
            To the beginning of the approach.
        height : float, length
            From there to the surface, and back with the rapid speed.
        reach : float, length
            Of each of two arms in each of the ``curves``.
        curves : int

        Examples
        --------
        Six arms of 50 mm at 10 mm/s, 20 mm of approach at 5 mm/s, 1 s to settle, 100 mm in air:

        >>> model = CostModel(rapid=50.0, approach=5.0, feed=10.0, touch=1.0)
        >>> model.seconds(np.array([100.0]), 20.0, 50.0, 3)
        array([37.4])
        """
        own = self.touch + 2.0 * curves * self.points * self.point
        own += height / self.approach if self.approach else 0.0
        own += 2.0 * curves * reach / self.feed if self.feed else 0.0
        found: np.ndarray = own + (np.asarray(travel, float) + height) / self.rapid
        return found
