"""How an atlas is kept."""

from dataclasses import dataclass

from touchatlas.patch.fit.fit_patch import FitOptions
from touchatlas.patch.geometry.arrays import real

# A patch that bears more tolerances than this, or is no smaller, shows nothing of its surface.
_MOST = 1e3
# Of smaller cores it takes hundreds to cover what one patch is fitted to.
_LEAST_CORE = 0.1
# Lengths beyond these, or their inverses, leave double precision in their sixth powers.
_SMALLEST = 1e-50


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
        Where nothing was touched beyond, the surface is drawn among its samples as far as its
        predicted deviation is no more, in tolerances; amid covered patches up to three times that.
        Infinite: wherever patches reach.
    """

    fit: FitOptions = FitOptions(adaptive=False)
    bias: float = 0.2
    detail: float = 5.0
    least_radius: float = 10.0
    trust: float = 1.0

    def __post_init__(self) -> None:
        if not (isinstance(self.fit, FitOptions) and self.fit.core >= _LEAST_CORE):
            raise ValueError(
                f"fit is {self.fit!r}; it must be FitOptions with a core of {_LEAST_CORE} or more"
            )
        numbers = self.bias, self.detail, self.least_radius
        if not (all(0.0 <= real(x) <= _MOST for x in numbers) and real(self.trust) > 0.0):
            raise ValueError(
                f"bias, detail, least_radius, trust are {numbers[0]}, {numbers[1]}, {numbers[2]}, "
                f"{self.trust}; they must be numbers of tolerances >= 0, {_MOST:g} at most, and "
                "trust > 0"
            )


def check_tolerance(tolerance: float) -> float:
    """The tolerance of an atlas, if it is one.

    Raises
    ------
    ValueError
        No length > 0, or one whose powers double precision does not hold.
    """
    if not 0.0 < real(tolerance) < float("inf"):
        raise ValueError(f"tolerance is {tolerance}; it must be a length > 0")
    if not _SMALLEST <= tolerance <= 1.0 / _SMALLEST:
        raise ValueError(
            f"tolerance is {tolerance:.3g}; that is no size that double precision can take powers "
            "of: use another unit"
        )
    return float(tolerance)
