"""Doubt: something that speaks against an atlas, and where; doubts of a planner's end."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.words import count_of

# Distance between places of one doubt, over the extent, and how many are named. Doubled, fewer or
# more places are named.
_APART, MOST = 0.1, 5
# The places of a doubt that concerns the whole.
NOWHERE = np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Doubt:
    """Something that speaks against an atlas.

    Parameters
    ----------
    name : str
        Short name, always the same for the same kind.
    words : str
        What was found and what to do, one sentence.
    places : (k, 3) float, length, world
        Where, five places at most; none where it concerns the whole.
    """

    name: str
    words: str
    places: np.ndarray

    def as_dict(self) -> dict:
        """The doubt, ready for JSON."""
        return {"name": self.name, "words": self.words, "places": self.places.tolist()}


def some_apart(points, extent: float) -> np.ndarray:
    """The first of points (n, 3) that are far from each other, five at most."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(((point - other) ** 2).sum() > (_APART * extent) ** 2 for other in kept):
            kept.append(point)
        if len(kept) == MOST:
            break
    return np.reshape(kept, (-1, 3))


def missed_words(diameter: float, place) -> str:
    """That a hole or a horn of a diameter, length, may be at a place (3,), as a sentence."""
    at = ", ".join(f"{x:.4g}" for x in place)
    return (
        f"A hole or a horn of up to {diameter:.3g} across may have been missed, near ({at}): no "
        "larger disc on the surface is without a sample."
    )


# The reason of a planner that has reached its end.
_KNOWN = "known to the tolerance"


class Forecast(Protocol):
    """What a planner's Stop expects of the surface, as far as it is read here."""

    @property
    def predicted_coverage(self) -> float: ...
    @property
    def open_places(self) -> np.ndarray: ...


class Stopped(Protocol):
    """A planner's Stop, as far as it is read here; its ``reason`` is an Enum of words."""

    @property
    def reason(self) -> Enum: ...
    @property
    def forecast(self) -> Forecast: ...
    @property
    def unreachable(self) -> np.ndarray: ...


def stop_doubts(
    stopped: str | Stopped | None,
    open_places: Sequence | np.ndarray,
    unreachable: Sequence | np.ndarray,
) -> list[Doubt]:
    """What speaks against an exploration that ended so: see ``doubts``."""
    if stopped is not None and not isinstance(stopped, str):
        stopped, open_places, unreachable = _of_stop(stopped, open_places, unreachable)
    found = []
    if stopped and stopped != _KNOWN:
        found.append(Doubt("unfinished", f"The exploration ended early: {stopped}.", NOWHERE))
    if len(places := _points(open_places)):
        words = f"{count_of(len(places), 'place is', 'places are')} not known to the tolerance; "
        found.append(Doubt("open places", words + "touch there.", places[:MOST]))
    if len(places := _points(unreachable)):
        words = (
            f"{count_of(len(places), 'place was', 'places were')} not touched, because the pin "
            "would have passed through what is known; lean it, or take a thinner one."
        )
        found.append(Doubt("unreachable", words, some_apart(places, box_diagonal(places))))
    return found


def ended_early(reason: str, share: float) -> str:
    """Why an exploration ended, with the expected fraction of the surface about its touches that is
    known to the tolerance: what lies farther off no forecast counts."""
    return f"{reason}, with {share:.1%} of the surface about its touches {_KNOWN}"


def _points(places: Sequence | np.ndarray) -> np.ndarray:
    """Places as an array (k, 3)."""
    return np.reshape(np.asarray(places, float), (-1, 3))


def _of_stop(stop: Stopped, open_places, unreachable):
    """Words of a planner's Stop, and its places where no others are given."""
    words = str(stop.reason.value)
    if not len(unreachable):
        unreachable = stop.unreachable
    if words == _KNOWN:
        return words, open_places, unreachable
    share = stop.forecast.predicted_coverage
    if not len(open_places):
        open_places = stop.forecast.open_places
    return ended_early(words, share), open_places, unreachable
