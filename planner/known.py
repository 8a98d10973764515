"""How much of the surface is known: errors over predicted deviations, and growth touch by touch."""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import erf, ndtri

from touchatlas.atlas.faces.faces import Faces
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.planner.options import PlannerLevels


@dataclass
class DeviationRatio:
    """The ratio of errors to predicted deviations, from the innovations of the last touches.

    It is such that intervals hold 95 % of new samples, and 1 at least. Quantiles do not depend on
    the few samples where a patch is wrong. Contours are so few that a ratio below 1 may be chance.
    """

    latest: list[np.ndarray] = field(default_factory=list)

    def learn(self, innovations) -> None:
        """Take the innovations (k,) of a touch; see ``AtlasChange``. Those of eight touches
        count."""
        if len(innovations):
            self.latest = [*self.latest, np.abs(innovations)][-8:]

    def within(self, deviations) -> np.ndarray:
        """Chance that an error is less than so many predicted deviations, as an array of the same
        shape.

        Either all errors are that much larger than predicted, or a part of the patches is wrong, as
        at a thin rim that they round off, and the others are right. The likelier law counts. Chance
        makes one error in 500 million larger than six deviations.
        """
        # 150 errors of right predictions, evenly spread over a normal distribution, come first.
        before = ndtri(0.5 + (np.arange(150) + 0.5) / 300)
        deviations = np.asarray(deviations) / np.sqrt(2.0)
        errors = np.concatenate([before, *self.latest])
        right = errors[errors <= 6.0]
        part = len(right) / len(errors) * erf(deviations / _ratio(right))
        return np.asarray(np.maximum(erf(deviations / _ratio(errors)), part))


def _ratio(errors) -> float:
    """The factor for deviations whose 95 % intervals hold 95 % of errors (n,) in deviations; 1 at
    least."""
    return max(1.0, float(np.quantile(errors, 0.95)) / SURE)


def structure_of(faces: Faces | None) -> tuple[int, int, int, str]:
    """Numbers of faces, edges and rounded edges, and the kind of a single face: where one changes,
    so does the surface."""
    if faces is None:
        return 0, 0, 0, ""
    rounded = sum(edge.radius > 0.0 for edge in faces.edges)
    return len(faces), len(faces.edges), rounded, faces.faces[0].kind if len(faces) == 1 else ""


@dataclass
class KnownArea:
    """The area within the tolerance after each touch, by predicted deviations alone, and its share
    of the surface, by what new samples show of these."""

    coverage: float = 0.0
    areas: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)

    def measure(self, inside: float, total: float, unscaled: float, again: bool) -> None:
        """Take the area within the tolerance, all area, and the first by predicted deviations
        alone, length^2; ``again`` where no touch was learned since the last time."""
        self.coverage = inside / total if total > 0.0 else 0.0
        if not again:
            # The ratio of errors to deviations rises where touches meet a thin rim, and what was
            # known before would count for less.
            self.areas.append(unscaled)
            self.shares.append(self.coverage)

    def stagnates(self, levels: PlannerLevels) -> bool:
        """Whether too little has been added for long.

        The share alone falls where new surface is found, and the area alone where cells are
        measured again. Near the end the share grows slowly, but a tenth of what is missing may
        still be found.
        """
        area, area_before = self._best(self.areas, levels.patience)
        share, share_before = self._best(self.shares, levels.patience)
        least = 1.0 + levels.patience * levels.growth
        return not (
            area >= least * area_before
            or share >= least * share_before
            or 1.0 - share < 0.9 * (1.0 - share_before)
        )

    def _best(self, values: list[float], patience: int) -> tuple[float, float]:
        """The largest of the latest values, and of those before; these are 0 at the beginning."""
        patience = max(patience, len(values) // 4)
        return max(values[-patience:], default=0.0), max(values[:-patience], default=0.0)
