"""Innovations: by how much new samples differ from what was predicted before them."""

import numpy as np

from touchatlas.atlas.state import AtlasState

# Largest predicted deviation of a place that was known, in scales: farther from all samples
# polynomials tell nothing. Doubled, these places count for more.
_KNOWN = 4.0


def innovations(state: AtlasState, points) -> np.ndarray:
    """(k,) distances of new samples (n, 3) from the surface that was predicted before them, in
    standard deviations (no unit), of those k samples that tell how good the prediction was.

    The standard deviation is that of the surface and of the sample together. Where a body is made
    of laws, these are so much surer than a sample that all samples tell whether they hold. On
    free-form faces samples whose noise is larger than the predicted deviation tell nothing. If
    predictions are right, the squares have a mean of 1 (Bar-Shalom, Li, Kirubarajan: Estimation
    with Applications to Tracking and Navigation, 2001, section 5.4).
    """
    if state.body is None:
        return np.zeros(0)
    found, some = state.body.at(points)
    some = some & (found.deviation <= _KNOWN * state.scale)
    if state.known_body.is_one and not state.body.faces.are_lawful:
        some &= found.deviation >= state.sample_std
    off = found.distance[some] / np.hypot(found.deviation[some], state.sample_std)
    return np.asarray(off)
