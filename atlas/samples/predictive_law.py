"""PredictiveLaw: how errors of the surface are distributed, learned from what new samples show."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import erfc, gammaln, stdtr, stdtrit

from touchatlas.patch.geometry.normal_error import SURE

# Number of touches that count.
LATEST = 8
# Standard deviations farther than which a sample lies on another face: chance makes one error of
# 500 million so large.
_OFF = 6.0
_TINY = float(np.finfo(float).tiny)
# Columns of innovations: see ``innovations_of``.
_NUMBER, _DISTANCE, _DEVIATION, _NOISE, _STD, _AWAY = range(6)


@dataclass(frozen=True)
class LawPrior:
    """What smooth, lawful and scanned bodies show of the law before any sample does.

    Fitted to the true errors in the second halves of 22 explorations, degrees of freedom were 2.5
    and more (median 8), and floors 0 to 0.78 (median 0.05). Factors were 0.5 to 0.8 where faces
    fit, because half of the variance of a sample is by default a lack of fit that counts as noise,
    and about 1 where kriging follows a rough surface.

    Parameters
    ----------
    freedom, freedom_spread : float
        Median of the degrees of freedom, and standard deviation of their logarithm.
    factor, factor_spread : float
        Those of the factor.
    floor : float
        Standard deviation of the floor, in deviations of a sample.
    independent : float
        Samples of one touch that count: those of a contour share most of their error.
    """

    freedom: float = 7.0
    freedom_spread: float = 0.5
    factor: float = 0.8
    factor_spread: float = 0.2
    floor: float = 0.3
    independent: float = 5.0


@dataclass(frozen=True)
class PredictiveLaw:
    """Distribution of the error of the surface at a point.

    It is a Student t of the scale √((a s)² + f²), where s is the predicted standard deviation: a
    scale mixture of normal laws, because s is not known exactly. A face may end unseen between
    samples, which are events of a Poisson process. An error that all samples share is normal; the
    sum of both has degrees of freedom after Welch (1947).

    Parameters
    ----------
    freedom : float
        Degrees of freedom ν of the t.
    factor : float
        a, no unit.
    floor : float, length
        f.
    rate : float, 1/length
        Faces that end, per distance from the nearest sample.
    spread : float
        Standard deviation of the logarithm of the factor: how well the law itself is known.
    systematic : float, length
        Standard deviation of the error that all samples share, of which they show nothing.

    Examples
    --------
    With many degrees of freedom it is the normal law.

    >>> float(PredictiveLaw(1e6, 1.0, 0.0).chance(1.96, [1.0], [0.0]).round(3)[0])
    0.95
    """

    freedom: float = LawPrior.freedom
    factor: float = LawPrior.factor
    floor: float = 0.0
    rate: float = 0.0
    spread: float = LawPrior.factor_spread
    systematic: float = 0.0

    @property
    def wider(self) -> "PredictiveLaw":
        """The law whose errors are larger by one standard deviation of what is known of them."""
        grown = np.exp(self.spread)
        return replace(self, factor=self.factor * grown, floor=self.floor * grown)

    def scale(self, deviation) -> np.ndarray:
        """(n,) scales of the t, length, at predicted deviations (n,), length."""
        return self._law(deviation)[0]

    def _law(self, deviation) -> tuple[np.ndarray, np.ndarray | float]:
        """(n,) scales of the t, length, and its degrees of freedom (n,), or one number."""
        own = np.hypot(self.factor * np.asarray(deviation), self.floor)
        if not self.systematic:
            return own, self.freedom
        # A million times smaller than the error that all share, the own one leaves a normal law.
        share = self.systematic / np.maximum(own, 1e-6 * self.systematic)
        return np.hypot(own, self.systematic), self.freedom * np.hypot(1.0, share) ** 4

    def chance(self, limit, deviation, away) -> np.ndarray:
        """(n,) chance of an error of no more than a limit, length, at predicted deviations (n,) and
        ``away`` (n,) from the nearest samples, length."""
        scale, freedom = self._law(deviation)
        ratio = limit / np.maximum(scale, _TINY)
        inside = 1.0 - 2.0 * stdtr(freedom, -ratio)
        return np.asarray(np.exp(-self.rate * np.asarray(away)) * inside)

    def deviations(self, deviation) -> np.ndarray:
        """(n,) deviations, length, for predicted ones (n,), length: 1.96 of them hold 95 % of the
        errors of right faces."""
        scale, freedom = self._law(deviation)
        return np.asarray(stdtrit(freedom, 0.975) / SURE * scale)


def innovations_of(number: int, distance, deviation, noise, std, away) -> np.ndarray:
    """What the samples of one touch show of the surface that was predicted before them.

    Parameters
    ----------
    number : int
        Index of the first of the samples, which tells touches apart.
    distance, deviation : (n,) float, length
        Distance of each from the surface, and the predicted standard deviation of that.
    noise, std : (n,) float, length
        Standard deviation of the noise of the samples, and with the allowed lack of fit.
    away : (n,) float, length
        Distance from the nearest sample before.

    Returns
    -------
    (n, 6) float
        These columns.
    """
    return np.column_stack(
        np.broadcast_arrays(float(number), distance, deviation, noise, std, away)
    )


def error_law_of(innovations, std: float, of_faces: bool = True) -> PredictiveLaw:
    """The most probable law after innovations (n, 6), of samples of a deviation ``std``, length.

    On a body of faces, samples on another face than the predicted one count for the rate alone; one
    free-form face does not end. Distances have the variance of the noise besides. The maximum is
    that of a lattice of values.
    """
    innovations, prior = np.asarray(innovations, float).reshape(-1, 6), LawPrior()
    right = innovations[~_are_off(innovations)] if of_faces else innovations
    freedom, factor, floor = (
        axis.ravel()
        for axis in np.meshgrid(
            prior.freedom * np.exp(prior.freedom_spread * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])),
            prior.factor * np.exp(prior.factor_spread * np.linspace(-3.0, 4.0, 15)),
            std * prior.floor * np.linspace(0.0, 4.0, 6),
        )
    )
    score = -0.5 * (np.log(freedom / prior.freedom) / prior.freedom_spread) ** 2
    score -= 0.5 * (np.log(factor / prior.factor) / prior.factor_spread) ** 2
    score -= 0.5 * (floor / max(std * prior.floor, _TINY)) ** 2
    for number in np.unique(right[:, _NUMBER]):
        own = right[right[:, _NUMBER] == number]
        # About thirty of them tell as much as all: neighbours err alike.
        own = own[:: max(1, len(own) // 30)]
        weight = min(1.0, prior.independent / len(own))
        score += weight * _log_density(own, freedom, factor, floor).sum(axis=0)
    best = int(score.argmax())
    rate = rate_of(innovations) if of_faces else 0.0
    weight, logarithm = np.exp(score - score[best]), np.log(factor)
    spread = np.sqrt(np.cov(logarithm, aweights=weight, ddof=0))
    return PredictiveLaw(
        float(freedom[best]), float(factor[best]), float(floor[best]), rate, float(spread)
    )


def rate_of(innovations) -> float:
    """Rate at which faces end unseen, 1/length: the number of innovations (n, 6) on another face
    over the sum of distances from the nearest samples, the estimate of largest likelihood where
    distances are short against one over the rate. At a sample no face can end unseen."""
    off = _are_off(innovations) & (innovations[:, _AWAY] > 0.0)
    return float(off.sum() / max(innovations[:, _AWAY].sum(), _TINY))


def _are_off(innovations) -> np.ndarray:
    """(n,) whether samples lie on another face than the predicted one."""
    limit = _OFF * np.hypot(innovations[:, _DEVIATION], innovations[:, _STD])
    return np.asarray(np.abs(innovations[:, _DISTANCE]) > limit)


def _log_density(innovations, freedom, factor, floor) -> np.ndarray:
    """(n, m) logarithm of the density of distances of innovations (n, 6) under m laws, of the
    scale of the surface and of the noise together."""
    deviation, noise = innovations[:, _DEVIATION, None], innovations[:, _NOISE, None]
    square = (factor * deviation) ** 2 + floor**2 + noise**2
    square = np.maximum(square, _TINY)
    ratio = innovations[:, _DISTANCE, None] ** 2 / (freedom * square)
    constant = gammaln(0.5 * (freedom + 1.0)) - gammaln(0.5 * freedom) - 0.5 * np.log(freedom)
    return np.asarray(constant - 0.5 * np.log(square) - 0.5 * (freedom + 1.0) * np.log1p(ratio))


def deviation_with_misses(deviation, away, innovations) -> np.ndarray:
    """Deviations (n,), length, whose 95 % intervals hold where a face may end unseen.

    That a face ends before the next sample is taken as a Poisson process along the distance from
    the nearest one, see ``rate_of``. A face that ends is off by a normal error of the root mean
    square of those that did.

    Parameters
    ----------
    deviation, away : (n,) float, length
        Of the faces, and the distance from the nearest sample.
    innovations : (k, 6) float
        See ``innovations_of``.

    Examples
    --------
    One miss of 3 a length of 100 on average: at a distance of 1 the face is nearly believed.

    >>> missed = innovations_of(0, [0.0, 3.0], 0.1, 0.0, 0.0, [60.0, 40.0])
    >>> found = deviation_with_misses(np.ones(2), np.array([1.0, 100.0]), missed)
    >>> found.round(2).tolist()
    [1.02, 2.69]
    """
    deviation, innovations = np.asarray(deviation, float), np.reshape(innovations, (-1, 6))
    off = _are_off(innovations)
    if not off.any():
        return deviation
    missed = -np.expm1(-away * rate_of(innovations))
    size = float(np.sqrt((innovations[off, _DISTANCE] ** 2).mean()))
    low, high = deviation, np.maximum(deviation, size)
    # Halved 30 times, the bracket is a billionth of what it was.
    for _ in range(30):
        middle = 0.5 * (low + high)
        beyond = missed * erfc(SURE * middle / size / np.sqrt(2.0))
        beyond += (1.0 - missed) * erfc(SURE * middle / np.maximum(deviation, _TINY) / np.sqrt(2.0))
        is_low = beyond > erfc(SURE / np.sqrt(2.0))
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return np.asarray(high)
