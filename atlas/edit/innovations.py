"""Innovations: by how much new samples differ from what was predicted before them."""

import numpy as np

from touchatlas.atlas.field.predicted_deviation import predicted_deviation
from touchatlas.atlas.known_surface import blend
from touchatlas.atlas.state import AtlasState

# Largest predicted deviation of a place that was known, in scales: farther from all samples
# polynomials tell nothing. Doubled, these places count for more.
_KNOWN = 4.0


def innovations(state: AtlasState, points) -> np.ndarray:
    """(k,) distances of new samples (n, 3) from the surface that was predicted before them, in
    standard deviations (no unit), of those k samples that tell how good the prediction was.

    The standard deviation is that of the surface and of the sample together. Samples whose noise is
    larger than the predicted deviation, or where nothing was known, tell nothing. If predictions
    are right, the squares have a mean of 1 (Bar-Shalom, Li, Kirubarajan: Estimation with
    Applications to Tracking and Navigation, 2001, section 5.4).
    """
    if not state.table.size:
        return np.zeros(0)
    found = blend(state, points)
    if state.body is not None:
        # Laws are so much surer than a sample that all samples tell whether they hold.
        some = found.known & (found.deviation <= _KNOWN * state.scale)
        if state.known_law.is_one: some&=found.deviation>=state.sample_std
        return np.asarray(found.distance / np.hypot(found.deviation, state.sample_std))[some]
    deviation = predicted_deviation(state.table, found)
    noise = state.table.measurement_std[np.maximum(found.patch, 0)]
    some = found.known & (noise <= deviation) & (deviation <= _KNOWN * state.scale)
    out: np.ndarray = found.distance[some] / np.hypot(deviation[some], noise[some])
    return out
