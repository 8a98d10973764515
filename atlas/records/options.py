"""AtlasOptions: how an atlas fits its patches, and how finely it draws them."""

from dataclasses import dataclass

from touchatlas.patch.geometry.arrays import real

# Largest option in tolerances or scales: a surface with a larger error shows nothing. Doubled,
# nothing changes for sensible options.
_MOST = 1e3
# Least distance of triangles from the surface, in tolerances: finer ones show nothing and fill the
# memory. Doubled, it refuses what some may wish.
_FINEST = 1e-3
# Least tolerance, and inverse of the largest, in the user's unit: sixth powers of lengths must be
# within double precision. Doubled, nothing changes.
_SMALLEST = 1e-50


@dataclass(frozen=True)
class AtlasOptions:
    """How an atlas fits its patches, and how finely it draws them.

    Parameters
    ----------
    bias : float
        Lack of fit that counts as if it were noise, in scales of the atlas.
    facets : float
        Largest distance of the triangles from the surface, in tolerances. Half of it makes about
        twice as many triangles.
    """

    bias: float = 0.2
    facets: float = 0.2

    def __post_init__(self) -> None:
        if not _FINEST <= real(self.facets) <= _MOST:
            raise ValueError(
                f"facets is {self.facets!r}; it must be a number of tolerances, {_FINEST:g} to "
                f"{_MOST:g}"
            )
        if not 0.0 <= real(self.bias) <= _MOST:
            raise ValueError(
                f"bias is {self.bias!r}; it must be a number of scales >= 0, {_MOST:g} at most"
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
