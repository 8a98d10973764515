"""FreeForm: where to touch a surface of any form, from the places of its patches."""

from functools import partial

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.place.details import detail_target, is_whole, last_target
from touchatlas.planner.place.deviation_ratio import DeviationRatio
from touchatlas.planner.place.hole_list import HoleList
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.place.places import Places
from touchatlas.planner.place.rules import RULES


class FreeForm:
    """Where to touch a surface of any form.

    Slips of the probe, rims and holes come as soon as they are less sure than the rest; else a rule
    of ``RULES`` chooses the place. None of this depends on the tolerance, but the end of an
    exploration that stagnates.

    Attributes
    ----------
    places : Places
        Those of all patches; up to date after ``areas``.
    """

    def __init__(self) -> None:
        self.places = Places()
        self._stale: set[int] = set()
        self._told = 0
        self._holes = HoleList()

    def learn(self, change: AtlasChange) -> None:
        """Take what a touch changed."""
        self._stale.update((*change.added, *change.changed))
        self.places.deviation_ratio.learn(change.innovations)
        self._told += 1

    def forget_errors(self) -> None:
        """Forget what new samples told of the predicted deviations."""
        self.places.deviation_ratio = DeviationRatio()

    def update(self, atlas: Atlas) -> None:
        """Compute the places of the patches that changed since the last time."""
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
        """Where to touch next, if anywhere, and whether the surface is known. It is not drawn while
        plans pend."""
        enough, pending = known.coverage >= options.coverage, len(view.pending) > 0
        sure = partial(self._is_sure, view, options.coverage)
        if enough and (pending or is_whole(view, self._holes, sure)):
            return None, True
        target = None if pending else detail_target(view, self._holes, sure)
        if target is None and not known.stagnates():
            target = RULES[options.name](view, rng)
        if target is None and not pending:
            target = last_target(view, self._holes)
        return target, enough

    def _is_sure(self, view: View, coverage: float, length: float) -> bool:
        """Whether a share of the surface is known to a length."""
        inside, total, _ = self.places.areas(view.atlas, view.is_untried, length)
        return inside >= coverage * total > 0.0
