"""How an atlas is kept."""

from dataclasses import dataclass

from touchatlas.patch.fit import FitOptions


@dataclass(frozen=True)
class AtlasOptions:
    """What an atlas bears, and how it fits.

    Parameters
    ----------
    fit : FitOptions
    bias : float
        Lack of fit that is borne as if it were noise, in tolerances.
    detail : float
        Lack of fit that a patch may have before its radius is reduced, in tolerances: what
        ``learn_residuals`` is to explain.
    least_radius : float
        No patch is made smaller than this for its contours' sake, in tolerances.
    trust : float
        The surface is drawn among its samples, where its predicted deviation is no more, in
        tolerances; infinite: wherever patches reach.
    """

    fit: FitOptions = FitOptions(adaptive=False)
    bias: float = 0.2
    detail: float = 5.0
    least_radius: float = 10.0
    trust: float = 1.0

    def __post_init__(self) -> None:
        numbers = self.bias, self.detail, self.least_radius
        if not (all(0.0 <= x < float("inf") for x in numbers) and self.trust > 0.0):
            raise ValueError(
                f"bias, detail, least_radius, trust are {numbers[0]}, {numbers[1]}, {numbers[2]}, "
                f"{self.trust}; they must be numbers of tolerances >= 0, and trust > 0"
            )
