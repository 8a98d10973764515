"""How much of the surface is known, and its growth touch by touch."""

from dataclasses import dataclass, field

from touchatlas.planner.options import PlannerLevels


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
