"""DeviationRatio: how much larger errors are than predicted, as new samples tell."""

import numpy as np
from scipy.special import erf, ndtri

from touchatlas.atlas.faces.faces import Faces
from touchatlas.patch.geometry.normal_error import SURE

# Touches whose samples count. Doubled, the ratio follows later what residuals explain.
_TOUCHES = 8
# Innovations of right predictions that are thought to have come before all others, evenly spread
# over a normal distribution: 150, where a contour has some twenty. Doubled, the first touches
# change less.
_BEFORE = ndtri(0.5 + (np.arange(150) + 0.5) / 300)
# Fraction of the errors that the predicted interval shall hold: what ``SURE`` deviations hold.
_HELD = 0.95
# Error of a patch that is wrong, in predicted deviations: chance gives one in 500 million. Doubled,
# errors at a rim that patches round off count as if all predictions were too sure.
_WRONG = 6.0


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
        """By what predicted deviations are multiplied, so that intervals hold 95 % of new samples;
        1 at least.

        Quantiles do not depend on the few samples where a patch is wrong. Contours are so few that
        a ratio below 1 may be chance: with it a bottle was 0.989 known where 0.997 was predicted.
        """
        return _ratio(np.concatenate([_BEFORE, *self._latest]))

    def within(self, deviations) -> np.ndarray:
        """Chance that an error is less than so many predicted deviations, as an array of the same
        shape.

        Either all errors are that much larger than predicted, or a part of the patches is wrong, as
        at a thin rim that they round off, and the others are right. The likelier law counts.
        """
        found = np.concatenate([_BEFORE, *self._latest])
        right = found[found <= _WRONG]
        chance: np.ndarray = erf(np.asarray(deviations) / (np.sqrt(2.0) * _ratio(found)))
        if len(right) == len(found):
            return chance
        part = len(right) / len(found) * erf(deviations / (np.sqrt(2.0) * _ratio(right)))
        return np.maximum(chance, part)


def _ratio(errors) -> float:
    """The factor for deviations whose 95 % intervals hold 95 % of errors (n,) in deviations; 1 at
    least."""
    return max(1.0, float(np.quantile(errors, _HELD)) / SURE)


def structure_of(faces: Faces) -> tuple[int, int, int, str]:
    """Numbers of faces, edges and rounded edges, and the kind of a single face: where one changes,
    so does the surface."""
    rounded = sum(edge.radius > 0.0 for edge in faces.edges)
    return len(faces), len(faces.edges), rounded, faces.faces[0].kind if len(faces) == 1 else ""
