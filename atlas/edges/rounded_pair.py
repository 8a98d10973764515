"""RoundedPair: what samples say of the rounding of an edge of two labels."""

import numpy as np

from touchatlas.atlas.edges.rolling_ball import ball_radius, radius_slope, rounded_edge
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import Labels

# Largest cosine of the normals of two faces with an edge: 20 degrees; and least, where a rounded
# edge is half of a tube.
_EDGE = np.cos(np.deg2rad(20.0))


class PiecesAt:
    """Distances and normals of the pieces of labels at samples (m,), each evaluated once."""

    def __init__(self, labels: Labels, samples) -> None:
        self.labels, self.samples = labels, samples
        self.points = labels.evidence.samples.points[samples]
        self.std = labels.evidence.samples.stds[samples]
        self._found: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def __getitem__(self, label: int) -> tuple[np.ndarray, np.ndarray]:
        if label not in self._found:
            self._found[label] = self.labels.pieces[label].at(self.points)
        return self._found[label]


class RoundedPair:
    """Signed distances of samples (m,) from two labels, times the sign of their edge, and the
    cosines of their normals."""

    def __init__(self, at: PiecesAt, pair, sign: float) -> None:
        self.evidence: Evidence = at.labels.evidence
        self.std = at.std
        (first, one), (second, other) = (at[k] for k in pair)
        self.first, self.second = sign * first, sign * second
        self.cosine = (one * other).sum(axis=1)

    def at(self, radius) -> tuple[np.ndarray, np.ndarray]:
        """Distances (m,) from the edge that is rounded with a radius, and the weights (m, 2) of
        both normals there."""
        return rounded_edge(self.first, self.second, self.cosine, radius)

    def nats(self, radius) -> np.ndarray:
        """(m,) nats of the distances from the rounded edge."""
        return self.evidence.misfit(self.at(radius)[0] / self.std)

    def ball_nats(self, radius: float) -> np.ndarray:
        """(m,) nats of the distances from the ball; beside it those of unexplained samples."""
        distance, weights = self.at(radius)
        nats = self.evidence.misfit(distance / self.std)
        return np.where(weights.min(axis=1) > 0.0, nats, self.evidence.options.unexplained)

    def radius(self) -> tuple[float, float] | None:
        """The radius that explains the samples best, by Gauss-Newton steps from the best of those
        of single samples, and its standard deviation; None where none lies inside of both faces,
        or these are no edge."""
        radii = ball_radius(self.first, self.second, self.cosine)
        radii = radii[np.isfinite(radii)]
        if not len(radii) or not -_EDGE < np.median(self.cosine) < _EDGE:
            return None
        tried = np.unique(np.quantile(radii, np.linspace(0.0, 1.0, 15)))
        # Deviations of the samples over the least of them.
        relative = self.std / np.min(self.std)
        radius, square = float(tried[self.nats(tried[:, None]).sum(axis=1).argmin()]), 0.0
        for _ in range(5):
            distance, weights = self.at(radius)
            good = self.evidence.misfit(distance / self.std) < self.evidence.options.unexplained
            slope = (radius_slope(weights) / relative)[good]
            square = float((slope**2).sum())
            if square <= 0.0:
                return None
            off = (distance / relative)[good]
            radius = max(radius - float((slope * off).sum()) / square, 0.0)
        return radius, float(np.min(self.std) / np.sqrt(square))
