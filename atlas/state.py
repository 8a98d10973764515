"""AtlasState: what an atlas learned, the samples, and the surface that follows from them."""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.choose import KnownBody, look_for_body
from touchatlas.atlas.body.less_tip import contacts, less_tip, rims_less_tip
from touchatlas.atlas.records.options import AtlasOptions, Levels, check_tolerance
from touchatlas.atlas.samples.evidence import ProbeEvidence
from touchatlas.atlas.samples.predictive_law import LATEST, PredictiveLaw, error_law_of
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import NO_TOUCH, SamplePool


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
    innovations : (k, 6) float
        What the latest touches showed of the surface that was predicted before them; see
        ``innovations_of``.
    evidence : ProbeEvidence
        What the touches say of the probe itself: its noise, its planes, a shift of the object.
    bad_contacts : (b, 3) float, length, world
        Points of touches that were left out, because no curve explains them.
    settled : int
        Index of the first sample since faces, edges or laws changed: before it errors were those of
        another surface.
    touches : int
        Number of touches, with those that were refused.
    systematic_std : float, length
        Standard deviation of the error that all samples share: see ``Touch``.
    scale_is_given : bool
        Whether the scale was given, and does not follow from the first touch.
    """

    def __init__(
        self, tolerance: float, options: AtlasOptions = AtlasOptions(), scale: float | None = None
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
        self.innovations = np.zeros((0, 6))
        self.evidence = ProbeEvidence(alpha=options.levels.alpha, prior=options.noise_prior)
        self.bad_contacts = np.zeros((0, 3))
        self.settled = 0
        self.touches = 0
        self.systematic_std = 0.0
        self._less_tip: tuple[KnownBody, SamplePool, Rims, KnownBody] | None = None

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

    @property
    def oldest_that_counts(self) -> int:
        """Index of the first sample of the last touches whose innovations count."""
        starts = np.flatnonzero(np.diff(self.pool.touches, prepend=NO_TOUCH - 1))
        return int(starts[-LATEST:].min(initial=len(self.pool)))

    def learn_innovations(self, innovations) -> None:
        """Take the innovations (n, 6) of the touch that was entered last."""
        every, oldest = np.concatenate([self.innovations, innovations]), self.oldest_that_counts
        self.innovations = every[every[:, 0] >= oldest]
        self.settled = max(self.settled, oldest)
        self.forget_law()

    def forget_law(self) -> None:
        """The law of errors follows from something that changed."""
        self.__dict__.pop("law", None)

    def catch_up(self) -> None:
        """Make the body of all samples, where it is that of the first of them."""
        if self.known_body.count < len(self.pool):
            self.take(look_for_body(self.pool, self.sample_std, self.known_body, self.levels))

    def take(self, known: KnownBody) -> None:
        """Take what was found, if it is anything new. One face and many miss in other ways."""
        if known.is_one_face != self.known_body.is_one_face:
            self.innovations, self.settled = np.zeros((0, 6)), 0
        if known is not self.known_body:
            self.know(known)

    def know(self, known: KnownBody) -> None:
        """Take what the samples show. The surface ends at the rims of this atlas, and is
        not where the probe passed."""
        if structure_of(known.body) != structure_of(self.body):
            self.settled = len(self.pool)
            self.forget_law()
        if known.body is not None:
            known = replace(known, body=known.body.with_air(self.ways, self.rims))
        self.known_body = known

    @cached_property
    def law(self) -> PredictiveLaw:
        """How the errors of the surface are distributed."""
        own = self.innovations[self.innovations[:, 0] >= self.settled]
        found = error_law_of(own, self.sample_std, not self.known_body.is_one_face)
        return replace(found, systematic=self.systematic_std)

    @property
    def tip_radius(self) -> float:
        """Radius of the ball whose centres the samples are, length; 0 where they are contacts."""
        return self.pool.tip_radius

    @property
    def without_tip(self) -> "AtlasState":
        """What is handed out: the state itself, or, where its samples are centres of a tip, one of
        their contacts. Plans are made for centres."""
        if not self.tip_radius or self.body is None:
            return self
        if self._less_tip is None or self._less_tip[0] is not self.known_body:
            pool = contacts(self.pool, self.body)
            rims = rims_less_tip(self.rims, pool, self.tip_radius)
            known = less_tip(self.known_body, pool, self.tip_radius, self.levels)
            assert known.body is not None
            known = replace(known, body=known.body.with_air(self.ways, rims))
            self._less_tip = self.known_body, pool, rims, known
        found = copy(self)
        _, found.pool, found.rims, found.known_body = self._less_tip
        return found

    @property
    def body(self) -> Body | None:
        """The surface that is drawn from faces; None where nothing was touched."""
        return self.known_body.body

    @property
    def point_count(self) -> int:
        """Number of samples of all touches."""
        return len(self.pool)


def structure_of(body: Body | None) -> tuple[int, int, int, str]:
    """Numbers of faces, edges and rounded edges, and the kind of a single face: where one changes,
    so does the surface."""
    if body is None:
        return 0, 0, 0, ""
    faces = body.faces
    rounded = sum(edge.radius > 0.0 for edge in faces.edges)
    return len(faces), len(faces.edges), rounded, faces.faces[0].kind if len(faces) == 1 else ""
