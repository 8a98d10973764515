"""Stop: why an exploration ended, and what is left."""

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from touchatlas.atlas.check.faults import Fault
    from touchatlas.atlas.check.free_disc import FreeDisc


class StopReason(Enum):
    """Why a planner has no more plans."""

    KNOWN = "known to the tolerance"
    TRIED = "every place left was tried"
    UNREACHABLE = "the places left cannot be reached"
    STAGNATION = "touches no longer improve what is known"
    NO_PATCH = "no touch gave a patch"
    MOVED = "the object has moved"


@dataclass(frozen=True, eq=False)
class Forecast:
    """What the atlas predicts of its own surface.

    Parameters
    ----------
    predicted_coverage : float
        Expected fraction of the surface about the touches that is within the tolerance; of the
        whole surface at the end of an exploration.
    open_places : (n, 3) float, length, world
        Where nothing is known, or too little, far apart from each other.
    uncertainty : float
        By how much less is expected where errors are larger by one standard deviation of what is
        known of them.
    """

    predicted_coverage: float
    open_places: np.ndarray
    uncertainty: float = 0.0


@dataclass(frozen=True, eq=False)
class Stop:
    """The end of an exploration.

    Parameters
    ----------
    reason : StopReason
    forecast : Forecast
    unreachable : (n, 3) float, length, world
        Places that were not touched because the pin would have passed through what was known.
    free_disc : FreeDisc or None
        The largest disc on the surface without a sample: how large a hole or a horn may have been
        missed. None where no surface is known.
    faults : tuple of Fault
        What the touches show to be wrong with the probe or the setting.
    """

    reason: StopReason
    forecast: Forecast
    unreachable: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    free_disc: "FreeDisc | None" = None
    faults: "tuple[Fault, ...]" = ()

    def __str__(self) -> str:
        """Why the exploration ended, what it may have missed, and what is wrong, in words."""
        words = f"{self.reason.value[0].upper()}{self.reason.value[1:]}."
        missed = [] if self.free_disc is None else [self.free_disc.words]
        return " ".join([words, *missed, *(fault.words for fault in self.faults)])
