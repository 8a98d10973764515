"""Touches that cannot be of the atlas they are added to: another unit of length."""

from touchatlas.atlas.records.touch import Touch, extent_of
from touchatlas.atlas.state import AtlasState

# Ratio of the longest contour of a touch and what was touched before, from which units differ:
# touches in metres among millimetres differ by 1000. Doubled, smaller ones pass.
_LARGER = 300.0
# Touches before one is asked. Doubled, a wrong unit passes for longer.
_ENOUGH = 3


def check_unit_of_length(state: AtlasState, touch: Touch, contours) -> None:
    """Refuse a touch that is much too small or too large for the patches so far.

    Raises
    ------
    ValueError
        When its contours are out of all proportion to the patches.
    """
    if state.touches < _ENOUGH or not len(state.pool):
        return
    length = max(extent_of(contour.points) for contour in contours)
    seen = extent_of(state.pool.points)
    if not seen / _LARGER <= length <= _LARGER * seen:
        raise ValueError(
            f"the contours of touch {touch.number} are {length:.3g} long, but what was touched so "
            f"far measures {seen:.3g}; give all touches in the same unit"
        )
