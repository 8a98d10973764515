"""FreeForm: where to touch a surface of any form, from the places of its patches."""

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import (
    Target,
    View,
    hole_targets,
    open_places,
    rim_target,
    slip_target,
)
from touchatlas.planner.place.deviation_ratio import DeviationRatio
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.place.places import Places
from touchatlas.planner.place.rules import RULES

# How often the surface is drawn to look for holes. Doubled, some more holes are closed, and
# explorations that leave many take longer.
_LOOKS = 4
# Holes that are touched before the surface is drawn again. Doubled, more touches find their holes
# closed already.
_HOLES = 16


class FreeForm:
    """Where to touch a surface of any form.

    A rule of ``RULES`` chooses the place until the surface is known; then slips of the probe are
    left, rims, and holes of the surface.

    Attributes
    ----------
    places : Places
        Those of all patches; up to date after ``areas``.
    """

    def __init__(self) -> None:
        self.places = Places()
        self._stale: set[int] = set()
        self._told = 0
        self._holes: list[Target] = []
        self._looked = 0

    def learn(self, change: AtlasChange) -> None:
        """Take what a touch changed."""
        self._stale.update((*change.added, *change.changed))
        self.places.deviation_ratio.learn(change.innovations)
        self._told += 1

    def forget_errors(self) -> None:
        """Forget what new samples told of the predicted deviations."""
        self.places.deviation_ratio = DeviationRatio()

    def update(self, atlas: Atlas, all_places: bool = False) -> None:
        """Compute the places of the patches that changed since the last time, or of all."""
        if all_places:
            self.places.forget()
        self.places.update(atlas, self._stale, self._told)
        self._stale, self._told = set(), 0

    def areas(self, view: View) -> tuple[float, float, float]:
        """See ``Places.areas``."""
        return self.places.areas(view.atlas, view.is_untried)

    def left(self, view: View) -> np.ndarray:
        """See ``Places.left``."""
        return self.places.left(view.atlas, view.extent)

    def target(
        self,
        view: View,
        known: KnownArea,
        options: PlannerOptions,
        rng: np.random.Generator | None,
    ) -> tuple[Target | None, bool]:
        """Where to touch next, if anywhere, and whether the surface is known."""
        enough = known.coverage >= options.coverage
        # What is open is then a hole of the surface, until that was drawn too often.
        enough &= self._looked < _LOOKS or not len(open_places(view)[0])
        ends = enough or known.stagnates()
        target = None if ends else RULES[options.name](view, rng)
        for last in (slip_target, rim_target, self._next_hole):
            target = last(view) if target is None else target
        return target, enough

    def _next_hole(self, view: View) -> Target | None:
        """The next hole of the surface; None where there is none, or they were looked for too
        often."""
        if not self._holes and self._looked < _LOOKS and not len(view.pending):
            self._holes, self._looked = hole_targets(view)[:_HOLES], self._looked + 1
        return self._holes.pop(0) if self._holes else None
