"""DeviationRatio: how much larger errors are than predicted, as new samples tell."""

import numpy as np
from scipy.stats import halfnorm

# Touches whose samples count. Doubled, the ratio follows later what residuals explain.
_TOUCHES = 8
# Samples of right predictions that are thought to have come before all others: a contour has some
# twenty. Doubled, the first touches change less.
_BEFORE = 150
# Fraction of the errors that the predicted interval shall hold, and the half-width of that of a
# normal error, in standard deviations.
_HELD, _NORMAL = 0.95, 1.96


class DeviationRatio:
    """The ratio of errors to predicted deviations, from the innovations of the last touches."""

    def __init__(self) -> None:
        self._latest: list[np.ndarray] = []

    def learn(self, innovations) -> None:
        """Take the innovations (k,) of a touch; see ``AtlasChange``."""
        if len(innovations):
            self._latest = [*self._latest, np.abs(innovations)][-_TOUCHES:]

    @property
    def value(self) -> float:
        """By what predicted deviations are multiplied, so that intervals hold 95 % of new samples.

        Quantiles do not depend on the few samples where a patch is wrong.
        """
        before = halfnorm.ppf((np.arange(_BEFORE) + 0.5) / _BEFORE)
        return float(np.quantile(np.concatenate([before, *self._latest]), _HELD)) / _NORMAL
