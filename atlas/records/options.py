"""AtlasOptions: how an atlas fits its patches, and which errors it accepts."""

from dataclasses import dataclass

from touchatlas.patch.fit.fit_patch import FitOptions
from touchatlas.patch.geometry.arrays import real

# Largest option in tolerances: a patch with a larger error or radius shows nothing of its surface.
# Doubled, nothing changes for sensible options.
_MOST = 1e3
# Least core, as a fraction of the patch radius: of smaller ones, hundreds cover one patch. Doubled,
# it refuses some cores that work.
_LEAST_CORE = 0.1
# Least distance of triangles from the surface, in tolerances: finer ones show nothing and fill the
# memory. Doubled, it refuses what some may wish.
_FINEST = 1e-3
# Least tolerance, and inverse of the largest, in the user's unit: sixth powers of lengths must be
# within double precision. Doubled, nothing changes.
_SMALLEST = 1e-50


@dataclass(frozen=True)
class AtlasOptions:
    """How an atlas fits its patches, and which errors it accepts.

    Parameters
    ----------
    fit : FitOptions
        How each patch is fitted.
    bias : float
        Lack of fit that counts as if it were noise, in scales of the atlas.
    detail : float
        Lack of fit beyond which the radius of a patch is reduced, in scales. Smaller detail is
        left to residuals.
    least_radius : float
        Radius below which contours and residuals make no patch smaller, in scales.
    trust : float
        Largest predicted deviation with which the surface is drawn at an open rim, in tolerances;
        among covered patches it is three times as much. Infinite: wherever patches reach.
    facets : float
        Largest distance of the triangles from the patches' surface, in tolerances. Half of it makes
        about twice as many triangles.
    fill : bool
        Whether patches between touches are fitted as touches arrive. Without, an atlas
        has one patch a touch until ``Atlas.fill``.
    """

    fit: FitOptions = FitOptions(adaptive=False)
    bias: float = 0.2
    detail: float = 5.0
    least_radius: float = 10.0
    trust: float = 1.0
    facets: float = 0.2
    fill: bool = True

    def __post_init__(self) -> None:
        if not (isinstance(self.fit, FitOptions) and self.fit.core >= _LEAST_CORE):
            raise ValueError(
                f"fit is {self.fit!r}; it must be FitOptions with a core of {_LEAST_CORE} or more"
            )
        if not isinstance(self.fill, bool):
            raise ValueError(f"fill is {self.fill!r}; it must be True or False")
        if not _FINEST <= real(self.facets) <= _MOST:
            raise ValueError(
                f"facets is {self.facets!r}; it must be a number of tolerances, {_FINEST:g} to "
                f"{_MOST:g}"
            )
        numbers = self.bias, self.detail, self.least_radius
        if not (all(0.0 <= real(x) <= _MOST for x in numbers) and real(self.trust) > 0.0):
            raise ValueError(
                f"bias, detail, least_radius, trust are {numbers[0]}, {numbers[1]}, {numbers[2]}, "
                f"{self.trust}; they must be numbers of tolerances >= 0, {_MOST:g} at most, and "
                "trust > 0"
            )


def check_tolerance(tolerance: float, name: str = "tolerance") -> float:
    """A tolerance, or another length of a name, as a float, checked.

    Raises
    ------
    ValueError
        If it is no length > 0, or its powers are beyond double precision.
    """
    if not 0.0 < real(tolerance) < float("inf"):
        raise ValueError(f"{name} is {tolerance}; it must be a length > 0")
    if not _SMALLEST <= tolerance <= 1.0 / _SMALLEST:
        raise ValueError(
            f"{name} is {tolerance:.3g}; that is no size that double precision can take powers "
            "of: use another unit"
        )
    return float(tolerance)
