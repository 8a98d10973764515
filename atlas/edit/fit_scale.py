"""The scale of fits: the unit of their options, from the noise of the first touch."""

import numpy as np

from touchatlas.atlas.state import AtlasState

# Scale of the fits in standard deviations of the noise. Doubled, patches are larger and less
# accurate.
SCALE_NOISE = 5.0


def settle_scale(state: AtlasState, noise) -> None:
    """Take the scale from the standard deviations (k,) of the noise of the first contours, length,
    where none was given. Without noise it stays the tolerance."""
    is_settled = state.scale_is_given or len(state.membership.pool)
    if not is_settled and np.max(noise) > 0.0:
        state.scale = SCALE_NOISE * float(np.median(noise))
