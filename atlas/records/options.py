"""AtlasOptions: how an atlas fits its patches, draws them, and decides; Levels: what is enough."""

from dataclasses import dataclass, fields

import numpy as np

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
# Unit of the fits in standard deviations of the noise, where no other is given.
SCALE_NOISE = 5.0


@dataclass(frozen=True)
class Levels:
    """What is enough to decide: one level for each kind of question.

    Parameters
    ----------
    sure : float
        A sample is on a surface, and two values agree, up to this difference, in standard
        deviations of the difference. 4 are passed by chance once in 16,000.
    same_side : float, rad
        Largest angle of two normals that face the same side.
    believed : float
        Distance from its samples up to which a surface is believed, over the extent of all samples.
    vague : float
        Deviation up to which a surface among samples is known, over the distance up to which it is
        believed.
    alpha : float
        Chance with which a test refuses what is true.
    closed : float
        Largest length of the sum of normals times areas, over the sum of areas, of a surface that
        counts as closed: it is zero for one without openings, and half of a sphere has 0.5.
    passed : float
        Share of the ends at which contact was lost beyond which samples may lie by chance.

    Examples
    --------
    >>> round(Levels().facing, 3)
    0.5
    """

    sure: float = 4.0
    same_side: float = np.pi / 3.0
    believed: float = 0.15
    vague: float = 0.1
    alpha: float = 1e-3
    closed: float = 0.15
    passed: float = 0.1

    def __post_init__(self) -> None:
        most = {"sure": np.inf, "same_side": 0.5 * np.pi, "believed": 1.0, "vague": 1.0}
        most |= {"alpha": 1.0, "closed": 1.0, "passed": 1.0}
        for level in fields(self):
            value = real(getattr(self, level.name))
            if not 0.0 < value < most[level.name]:
                raise ValueError(
                    f"level {level.name} is {getattr(self, level.name)!r}; it must be a number > 0 "
                    f"and < {most[level.name]:.4g}"
                )

    @property
    def facing(self) -> float:
        """Least cosine of two normals that face the same side."""
        return float(np.cos(self.same_side))


@dataclass(frozen=True)
class AtlasOptions:
    """How an atlas fits its patches, how finely it draws them, and what it takes as enough.

    Parameters
    ----------
    bias : float
        Lack of fit that counts as if it were noise, in scales of the atlas.
    facets : float
        Largest distance of the triangles from the surface, in tolerances. Half of it makes about
        twice as many triangles.
    noise_prior : float
        Samples that the noise that contours state counts as, once it is refuted.
    levels : Levels
    """

    bias: float = 0.2
    facets: float = 0.2
    noise_prior: float = 5.0
    levels: Levels = Levels()

    def __post_init__(self) -> None:
        if not isinstance(self.levels, Levels):
            raise ValueError(f"levels are {self.levels!r}; they must be Levels")
        if not _FINEST <= real(self.facets) <= _MOST:
            raise ValueError(
                f"facets is {self.facets!r}; it must be a number of tolerances, {_FINEST:g} to "
                f"{_MOST:g}"
            )
        if not 0.0 < real(self.noise_prior) < np.inf:
            raise ValueError(f"noise_prior is {self.noise_prior!r}; it must be a number > 0")
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
