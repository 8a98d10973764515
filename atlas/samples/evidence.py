"""ProbeEvidence: what the touches say of the probe itself, whatever the shape of the object.

The part of a sample across its plane, the rest of a short curve, and the misses of curves that meet
at one contact are of the probe alone. Their squares over the stated variance follow chi-square
laws, which add up from touch to touch. Where contours of different touches cross, their gaps tell
of a move of the object.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.special import chdtrc

from touchatlas.atlas.samples.corrected import in_best_plane, in_one_place, noise_within, noisier
from touchatlas.atlas.samples.crossings import NO_CROSSINGS, Crossings
from touchatlas.atlas.samples.plane_test import meeting_of, plane_test
from touchatlas.patch.geometry.contour import Contour

# Independent squares that a sample adds to the estimate of the noise by short fits: seven of them
# share a fit of three parameters, and the median of the fits counts.
_PER_SAMPLE = 0.4


@dataclass(frozen=True, eq=False)
class TouchEvidence:
    """What one touch says of the probe. Squares are sums over the stated variance.

    Parameters
    ----------
    number : float
        Of the touch.
    samples, bad : float
        Number of samples, and of the bad contacts among them, which are left out.
    across, across_freedom : float
        Squares of the parts across the planes, and how many are independent.
    within, within_freedom : float
        The same of the rests of short curves.
    tilt, tilt_freedom, tilt_angle : float
        The same of what turned planes explain, and the angle, rad.
    miss, miss_freedom : float
        The same of the distances of the curves at the contact from their mean.
    miss_length, miss_noise : float, length^2
        Sum of these squares, and what noise gives in the mean.
    """

    number: float = 0.0
    samples: float = 0.0
    bad: float = 0.0
    across: float = 0.0
    across_freedom: float = 0.0
    within: float = 0.0
    within_freedom: float = 0.0
    tilt: float = 0.0
    tilt_freedom: float = 0.0
    tilt_angle: float = 0.0
    miss: float = 0.0
    miss_freedom: float = 0.0
    miss_length: float = 0.0
    miss_noise: float = 0.0

    @property
    def row(self) -> np.ndarray:
        """(k,) all numbers, for a file."""
        return np.array([getattr(self, field.name) for field in fields(self)])


# Numbers of a row.
WIDTH = len(fields(TouchEvidence))


@dataclass(frozen=True, eq=False)
class ProbeEvidence:
    """What all touches say of the probe.

    Parameters
    ----------
    touches : tuple of TouchEvidence
    alpha : float
        Chance with which an exploration of any length refuses what is true, for each question.
    prior : float
        Samples that the stated noise counts as, once it is refuted.
    crossings : Crossings
    """

    touches: tuple[TouchEvidence, ...] = ()
    alpha: float = 1e-3
    prior: float = 5.0
    crossings: Crossings = NO_CROSSINGS

    def sum(self, name: str) -> float:
        """A number, summed over the touches."""
        return float(sum(getattr(touch, name) for touch in self.touches))

    @property
    def chance(self) -> float:
        """Chance with which one test now may refuse what is true.

        The terms 1 / (k (k + 1)) add up to 1, so that all tests of an exploration do with a chance
        of ``alpha`` (alpha spending; Lan and DeMets, Discrete sequential boundaries, 1983).
        """
        count = max(len(self.touches), 1)
        return self.alpha / (count * (count + 1.0))

    def is_refuted(self, square: float, freedom: float) -> bool:
        """Whether a sum of squares is larger than chance explains."""
        return bool(chdtrc(freedom, square) < self.chance)

    def chance_of(self, name: str) -> float:
        """Chance of squares as large as those of a name, if the probe is as stated."""
        freedom = self.sum(f"{name}_freedom")
        return float(chdtrc(freedom, self.sum(name))) if freedom > 0.0 else 1.0

    def refutes(self, *names: str) -> bool:
        """Whether the squares of all names are larger than chance explains."""
        return all(self.chance_of(name) < self.chance for name in names)

    @property
    def noise_factor(self) -> float:
        """How many times the stated one the noise is.

        The stated noise stands, as a factor of 1, unless both the parts across the planes and the
        rests of short curves refute it: turned planes explain the one, fine detail of the surface
        the other. A smaller noise is not believed, because neither sees errors that neighbouring
        samples share. A refuted noise has an inverse gamma law for its variance, whose mean is
        taken; the stated one is that of ``prior`` samples before.

        Examples
        --------
        A hundred squares of nine each, in both:

        >>> touch = TouchEvidence(0, 100, 0, 900.0, 100.0, 900.0, 100.0)
        >>> round(ProbeEvidence((touch,)).noise_factor, 2)
        2.94
        """
        if not self.refutes("across", "within"):
            return 1.0
        ratios = [
            (self.prior + self.sum(name)) / (self.prior + self.sum(f"{name}_freedom"))
            for name in ("across", "within")
        ]
        return float(np.sqrt(max(min(ratios), 1.0)))

    @property
    def displacement(self) -> float:
        """Standard deviation of the displacement of each contour from the others of its touch,
        length; 0 where noise explains how they miss each other."""
        if not self.refutes("miss"):
            return 0.0
        more = self.sum("miss_length") - self.sum("miss_noise")
        return float(np.sqrt(max(more / self.sum("miss_freedom"), 0.0)))

    def and_of(self, number: int, contours, contact, bad: int) -> "ProbeEvidence":
        """With one more touch: its number, contours without bad contacts, the contact (3,), and
        how many bad contacts there were."""
        tests = [test for contour in contours if (test := plane_test(contour)) is not None]
        noisy = [contour for contour in contours if contour.noise_std > 0.0]
        count = _PER_SAMPLE * sum(len(contour.points) for contour in noisy)
        found = TouchEvidence(
            float(number),
            float(bad + sum(len(contour.points) for contour in contours)),
            float(bad),
            sum(test.square for test in tests),
            sum(test.freedom for test in tests),
            count * noise_within(noisy) ** 2 if noisy else 0.0,
            count,
            sum(test.tilt for test in tests),
            sum(test.tilt_freedom for test in tests),
            float(np.sqrt(np.mean(np.square([test.angle for test in tests] or [0.0])))),
        )
        every = replace(self, touches=(*self.touches, found))
        meeting = meeting_of(noisier(contours, every.noise_factor), contact, self.alpha)
        if meeting is None:
            return every
        misses, freedom = meeting.misses, len(meeting.heights) - 1.0
        found = replace(
            found,
            miss=float((misses**2 / meeting.variances).sum()),
            miss_freedom=freedom,
            miss_length=float((misses**2).sum()),
            miss_noise=freedom * float(meeting.variances.mean()),
        )
        return replace(self, touches=(*self.touches, found))

    def corrected(self, contours, contact) -> tuple[Contour, ...]:
        """Contours of the last touch, with its contact (3,), as the evidence corrects them: in the
        planes of their samples, with the noise that they have, and each moved to where it meets the
        others most probably. They stay the same where nothing is refuted."""
        if self.refutes("tilt"):
            contours = tuple(in_best_plane(contour, self.chance) for contour in contours)
        contours = noisier(contours, self.noise_factor)
        if spread := self.displacement:
            contours = in_one_place(contours, contact, spread, self.alpha)
        return tuple(contours)

    @property
    def table(self) -> np.ndarray:
        """(t, k) all numbers, for a file."""
        return np.reshape([touch.row for touch in self.touches], (-1, WIDTH))
