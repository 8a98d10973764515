"""Touches that cannot be of the atlas they are added to: another unit of length."""

import numpy as np

from touchatlas.atlas.records.touch import Touch, extent_of
from touchatlas.atlas.state import AtlasState

# Shortest and longest contour of a touch over the median patch radius: explorations of objects of
# all kinds have 0.7 to 31. Ten times as much apart, a touch in metres among millimetres passes.
_SHORTEST, _LONGEST = 0.02, 500.0
# Patches whose median is asked. Doubled, a wrong unit passes for longer.
_ENOUGH = 3


def check_unit_of_length(state: AtlasState, touch: Touch, contours) -> None:
    """Refuse a touch that is much too small or too large for the patches so far.

    Raises
    ------
    ValueError
        When its contours are out of all proportion to the patches.
    """
    rows = state.table.rows
    if len(rows) < _ENOUGH:
        return
    length = max(extent_of(contour.points) for contour in contours)
    # A patch for a large tolerance is larger than the object.
    seen = extent_of(state.membership.pool.points)
    radius = min(float(np.median(state.table.radius[rows])), seen)
    if not _SHORTEST * radius <= length <= _LONGEST * radius:
        raise ValueError(
            f"the contours of touch {touch.number} are {length:.3g} long, but the patches so far "
            f"have a radius of {radius:.3g}; give all touches in the same unit"
        )
