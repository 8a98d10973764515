"""Doubts about an atlas, in words that a person can act on: what its own samples say against it."""

from collections.abc import Sequence

import numpy as np

from touchatlas.atlas.check.doubt import Doubt, Stopped, stop_doubts
from touchatlas.atlas.check.faults import faults
from touchatlas.atlas.check.sample_doubts import edge_doubts, sample_doubts
from touchatlas.atlas.check.surface_doubts import surface_doubts
from touchatlas.atlas.check.tip_doubts import tip_doubts
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.state import AtlasState


def doubts(
    atlas: AtlasState,
    surface: Surface | None = None,
    open_places: Sequence | np.ndarray = (),
    stopped: str | Stopped | None = "",
    unreachable: Sequence | np.ndarray = (),
) -> tuple[Doubt, ...]:
    """What speaks against an atlas; empty where nothing does.

    Parameters
    ----------
    atlas : AtlasState
    surface : Surface, optional
        The atlas's Surface, whose pieces and holes are looked at.
    open_places : (k, 3) float, length, world
        Where a planner says that too little is known (``Forecast.open_places``).
    stopped : Stop or str, optional
        Why the exploration ended: a planner's ``stop``, whose places are taken if none are given,
        or words. It is no doubt if nothing is given, or the surface is known to the tolerance.
    unreachable : (k, 3) float, length, world
        Where a planner found no way for its pin (``Stop.unreachable``).

    Returns
    -------
    tuple of Doubt
        In the order of how much they say.

    Raises
    ------
    ValueError
        When the first arguments are no Atlas and no Surface.
    """
    if not isinstance(atlas, AtlasState):
        raise ValueError(f"got {type(atlas).__name__} for the atlas; call doubts(atlas, surface)")
    if surface is not None and not isinstance(surface, Surface):
        raise ValueError(
            f"got {type(surface).__name__} for the surface; give the Surface that extract_surface "
            "returns, or leave it out"
        )
    return (
        *stop_doubts(stopped, open_places, unreachable),
        *(fault.doubt for fault in faults(atlas)),
        *sample_doubts(atlas),
        *edge_doubts(atlas.without_tip),
        *tip_doubts(atlas),
        *surface_doubts(surface, atlas.without_tip),
    )
