"""How much of the surface is known, and its growth touch by touch."""

from dataclasses import dataclass, field

from touchatlas.planner.options import PlannerLevels


@dataclass(frozen=True)
class Areas:
    """Areas of a surface.

    Parameters
    ----------
    within : float, length^2
        Expected area within the tolerance.
    unscaled : float, length^2
        The same by the law that comes before all samples.
    known : float, length^2
    unknown : float, length^2
        Area of the strips beside rims in which nothing is known.
    """

    within: float
    unscaled: float
    known: float
    unknown: float


@dataclass
class KnownArea:
    """The area within the tolerance after each touch, by predicted deviations alone, its share of
    the surface, by what new samples show of these, and the areas when openings were largest."""

    levels: PlannerLevels = field(default_factory=PlannerLevels)
    coverage: float = 0.0
    areas: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    openest: Areas | None = None

    def measure(self, areas: Areas, again: bool) -> None:
        """Take the areas of the surface; ``again`` where no touch was learned since the last
        time."""
        self.coverage = self.share(areas)
        if not again:
            # The ratio of errors to deviations rises where touches meet a thin rim, and what was
            # known before would count for less.
            self.areas.append(areas.unscaled)
            self.shares.append(self.coverage)
            if self.openest is None or areas.unknown > self.openest.unknown:
                self.openest = areas

    def share(self, areas: Areas) -> float:
        """Share of the surface, with what is expected behind its openings, that is expected within
        the tolerance."""
        total = areas.known + self.behind(areas)
        return areas.within / total if total > 0.0 else 0.0

    def behind(self, areas: Areas) -> float:
        """Expected area behind openings, length^2.

        Of the strips beside rims that were unknown when openings were largest, the part that is
        known since had the area behind it that was found since. The part that is left has as much
        for its area, with the level ``behind`` for what is left of the strips themselves.
        """
        openest, left = self.openest or areas, areas.unknown
        if not left > 0.0:
            return 0.0
        found = max(areas.known - openest.known, 0.0)
        return left * (found + self.levels.behind * left) / max(openest.unknown, left)

    def stagnates(self) -> bool:
        """Whether too little has been added for long.

        The share alone falls where new surface is found, and the area alone where cells are
        measured again. Near the end the share grows slowly, but a tenth of what is missing may
        still be found.
        """
        area, area_before = self._best(self.areas, self.levels.patience)
        share, share_before = self._best(self.shares, self.levels.patience)
        least = 1.0 + self.levels.patience * self.levels.growth
        return not (
            area >= least * area_before
            or share >= least * share_before
            or 1.0 - share < 0.9 * (1.0 - share_before)
        )

    def _best(self, values: list[float], patience: int) -> tuple[float, float]:
        """The largest of the latest values, and of those before; these are 0 at the beginning."""
        patience = max(patience, len(values) // 4)
        return max(values[-patience:], default=0.0), max(values[:-patience], default=0.0)
