"""KnownArea: how much of the surface is within the tolerance, touch by touch."""

# Least part of the surface that is worth a touch, no unit. Doubled, explorations that stagnate end
# earlier.
_LEAST_SHARE = 1.25e-4
# Stagnation: neither the area within the tolerance nor its share of the surface has grown by
# ``_LEAST_SHARE`` a touch in so many touches, or by as much in the last quarter of all touches.
# Doubled, an exploration goes on for twice as long.
_PATIENCE, _PATIENCE_FRACTION = 16, 0.25
# Largest fraction of the share that was missing before, which is missing since. Doubled in what it
# asks, 0.8, explorations of scans end before their tolerance is met.
_SHRINKS = 0.9


class KnownArea:
    """The area within the tolerance after each touch, by predicted deviations alone, and its share
    of the surface, by what new samples told of these."""

    def __init__(self) -> None:
        self.coverage = 0.0
        self._areas: list[float] = []
        self._shares: list[float] = []

    def measure(self, inside: float, total: float, unscaled: float, again: bool) -> None:
        """Take the area within the tolerance, all area, and the first by predicted deviations
        alone, length^2; ``again`` where no touch was learned since the last time."""
        self.coverage = inside / total if total > 0.0 else 0.0
        if not again:
            # The ratio of errors to deviations rises where touches meet a thin rim, and what was
            # known before would count for less.
            self._areas.append(unscaled)
            self._shares.append(self.coverage)

    def stagnates(self) -> bool:
        """Whether too little has been added for long.

        The share alone falls where new surface is found, and the area alone where cells are
        measured again. Near the end the share grows slowly, but what is missing shrinks.
        """
        area, area_before = self._best(self._areas)
        share, share_before = self._best(self._shares)
        least = 1.0 + _PATIENCE * _LEAST_SHARE
        return not (
            area >= least * area_before
            or share >= least * share_before
            or 1.0 - share < _SHRINKS * (1.0 - share_before)
        )

    def _best(self, values: list[float]) -> tuple[float, float]:
        """The largest of the latest values, and of those before; these are 0 at the beginning."""
        patience = max(_PATIENCE, int(_PATIENCE_FRACTION * len(values)))
        return max(values[-patience:], default=0.0), max(values[:-patience], default=0.0)
