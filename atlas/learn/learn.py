"""Learn: the samples of a touch are checked, oriented and entered."""

import numpy as np

from touchatlas.atlas.learn.enter_samples import enter_samples
from touchatlas.atlas.learn.fit_touch import few_contours, fit_or_reason, is_from_outside
from touchatlas.atlas.learn.innovations import innovations
from touchatlas.atlas.learn.plausible_touch import check_unit_of_length
from touchatlas.atlas.learn.repeated_contours import learned_before
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch, TouchStatus
from touchatlas.atlas.state import AtlasState

# Scale of the fits in standard deviations of the noise. Doubled, patches are larger and less
# accurate.
SCALE_NOISE = 5.0


def learn(state: AtlasState, touch: Touch) -> AtlasChange:
    """Enter the samples of one touch and the way on which the probe came, or say why the samples
    are refused. Without contact only the way is entered."""
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe returns it")
    if touch.status is not TouchStatus.TOUCHED:
        _enter_way(state, touch)
        return AtlasChange(refused=f"the probe reported: {touch.status.value}")
    contours = tuple(c for c in touch.contours if len(c.points) >= LEAST_POINTS)
    if not contours:
        return AtlasChange(refused=few_contours(0))
    check_unit_of_length(state, touch, contours)
    if learned_before(state.pool, contours):
        return AtlasChange(
            refused=f"a contour of touch {touch.number} was learned before, point for point; give "
            "each once, because a repeated contour holds no new measurement"
        )
    _settle_scale(state, [contour.noise_std for contour in contours])
    fit, reason = fit_or_reason(state, touch, contours)
    if fit is None and not is_from_outside(state, touch, contours):
        return AtlasChange(refused=reason)
    outward = touch.approach if fit is None else fit.patch.frame.normal
    news = innovations(state, np.concatenate([contour.points for contour in contours]))
    enter_samples(state, contours, outward, None if fit is None else fit.patch)
    _enter_way(state, touch)
    return AtlasChange(innovations=news)


def _enter_way(state: AtlasState, touch: Touch) -> None:
    """Enter the way through air on which the probe came, if it is known."""
    if touch.way is not None:
        state.ways = np.concatenate([state.ways, touch.way[None]])


def _settle_scale(state: AtlasState, noise) -> None:
    """Take the scale from the standard deviations (k,) of the noise of the first contours, length,
    where none was given. Without noise it stays the tolerance."""
    if not (state.scale_is_given or len(state.pool)) and np.max(noise) > 0.0:
        state.scale = SCALE_NOISE * float(np.median(noise))
