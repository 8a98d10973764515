"""AtlasState: what an atlas learned, the samples, and the surface that follows from them."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.choose import KnownBody
from touchatlas.atlas.records.options import AtlasOptions, Levels, check_tolerance
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool


class AtlasState:
    """What an atlas has learned.

    Parameters
    ----------
    tolerance : float, length
        Error of the surface that is wanted.
    options : AtlasOptions
    scale : float, length, optional
        Unit of the options of the fits. Without it, five standard deviations of the noise of the
        first touch, or the tolerance where that has no noise: so that a looser tolerance costs no
        touch more.

    Attributes
    ----------
    pool : SamplePool
        The samples.
    rims : Rims
        The contour ends at which contact was lost, and the rims of the surface that they show.
    ways : (m, 2, 3) float, length, world
        Ends of straight ways through air on which the probe came.
    known_body : KnownBody
        What the samples show: the faces and the body.
    misses : (k, 3) float
        How often the latest touches missed the predicted faces; see ``misses_of``.
    touches : int
        Number of touches, with those that were refused.
    scale_is_given : bool
        Whether the scale was given, and does not follow from the first touch.
    """

    def __init__(
        self,
        tolerance: float,
        options: AtlasOptions = AtlasOptions(),
        scale: float | None = None,
    ) -> None:
        if not isinstance(options, AtlasOptions):
            raise ValueError(f"options are {options!r}; they must be AtlasOptions")
        self.tolerance = check_tolerance(tolerance)
        self.scale = self.tolerance if scale is None else check_tolerance(scale, "scale")
        self.scale_is_given = scale is not None
        self.options = options
        self.pool = SamplePool()
        self.rims = Rims(self.pool)
        self.ways = np.zeros((0, 2, 3))
        self.known_body = KnownBody()
        self.misses = np.zeros((0, 3))
        self.touches = 0

    def __len__(self) -> int:
        """Number of patches: those of the faces that the surface is drawn from."""
        return 0 if self.body is None else self.body.patch_count

    @property
    def levels(self) -> Levels:
        """What is enough to decide."""
        return self.options.levels

    @property
    def bias(self) -> float:
        """Lack of fit that counts as if it were noise, length."""
        return self.options.bias * self.scale

    @property
    def sample_std(self) -> float:
        """Standard deviation of the distance of the surest samples from the surface: the least
        noise that contours state, and the lack of fit that is borne, length."""
        noise = self.pool.noise.min() if len(self.pool) else 0.0
        return float(np.hypot(noise, self.bias))

    @property
    def sample_stds(self) -> np.ndarray:
        """(n,) standard deviation of the distance of each sample from the surface, length."""
        return np.hypot(self.pool.noise, self.bias)

    def know(self, known: KnownBody) -> None:
        """Take what the samples show. The surface ends at the rims of this atlas, and is
        not where the probe passed."""
        if known.body is not None:
            body = known.body.with_air(self.ways)
            body.rims = self.rims
            known = replace(known, body=body)
        self.known_body = known

    @property
    def body(self) -> Body | None:
        """The surface that is drawn from faces; None where nothing was touched."""
        return self.known_body.body

    @property
    def point_count(self) -> int:
        """Number of samples of all touches."""
        return len(self.pool)
