"""RoundedPair: samples beside an edge of two pieces, and the radius that rounds it best."""

import numpy as np

from touchatlas.atlas.edges.rolling_ball import ball_radius, radius_slope, rounded_edge
from touchatlas.atlas.labels.grow import Evidence

# Radii that are tried, the quantiles of those of single samples. Doubled, nothing changes.
_TRIED = 15
# Largest cosine of the normals of two faces with an edge: 20 degrees; and least: 160 degrees, where
# a rounded edge is half of a tube. Doubled, rims of cylinders are blunt edges.
_EDGE = np.cos(np.deg2rad(20.0))
# Gauss-Newton steps from the best of them. Doubled, nothing changes.
_STEPS = 5


class RoundedPair:
    """Signed distances of samples from two pieces, times the sign of their edge, from the values
    of both."""

    def __init__(self, evidence: Evidence, first, second, sign: float) -> None:
        self.evidence, self.std = evidence, evidence.samples.std
        self.first, self.second = sign * first[0], sign * second[0]
        self.cosine = (first[1] * second[1]).sum(axis=1)

    @property
    def is_edge(self) -> bool:
        """Whether the pieces face ways that differ by 20 to 160 degrees, in the median."""
        return bool(-_EDGE < np.median(self.cosine) < _EDGE)

    def at(self, radius) -> tuple[np.ndarray, np.ndarray]:
        """Distances (n,) from the edge that is rounded with a radius, and the weights (n, 2) of
        both normals there."""
        return rounded_edge(self.first, self.second, self.cosine, radius)

    def misfit(self, radius) -> np.ndarray:
        """(n,) nats of the distances from the rounded edge."""
        return self.evidence.misfit(self.at(radius)[0] / self.std)

    def ball_misfit(self, radius: float) -> np.ndarray:
        """(n,) nats of the distances from the ball; beside it those of unexplained samples."""
        distance, weights = self.at(radius)
        nats = self.evidence.misfit(distance / self.std)
        return np.where(weights.min(axis=1) > 0.0, nats, self.evidence.options.unexplained)

    def radius(self) -> tuple[float, float] | None:
        """The radius that explains the samples best, and its standard deviation; None where no
        sample on a ball lies inside of both faces."""
        radii = ball_radius(self.first, self.second, self.cosine)
        radii = radii[np.isfinite(radii)]
        if not len(radii):
            return None
        tried = np.unique(np.quantile(radii, np.linspace(0.0, 1.0, _TRIED)))
        radius = float(tried[self.misfit(tried[:, None]).sum(axis=1).argmin()])
        square = 0.0
        for _ in range(_STEPS):
            distance, weights = self.at(radius)
            slope = radius_slope(weights)
            good = self.evidence.misfit(distance / self.std) < self.evidence.options.unexplained
            square = float((slope[good] ** 2).sum())
            if square <= 0.0:
                return None
            radius = max(radius - float((slope * distance)[good].sum()) / square, 0.0)
        return radius, self.std / float(np.sqrt(square))
