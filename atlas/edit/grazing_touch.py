"""Grazing touches: which side of the surface is outside, where the probe came nearly along it."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit

# Cosine between approach and normal below which a touch grazes: 75 degrees. There a normal that is
# off by 15 degrees turns the patch inside out. Doubled, 59 degrees: the touches of steep walls that
# nothing is known about are refused.
_GRAZING = 0.26
# Largest distance of a known sample that tells the side, in what noise and bias explain together.
# Doubled, the far side of a wall of six noises has a say.
_NEAR = 3.0
# Least majority of such samples: one contour may have been turned itself.
_MAJORITY = 3


def grazes(fit: PatchFit, touch: Touch) -> bool:
    """Whether the probe came so nearly along the surface that its direction does not tell the outer
    side."""
    return bool(fit.patch.frame.normal @ touch.approach < _GRAZING)


def known_side(state: AtlasState, fit: PatchFit) -> int:
    """1 where the known samples on a fitted patch face as it does, -1 where they face the other
    way, and 0 where they do not tell."""
    patch, pool = fit.patch, state.membership.pool
    near = state.membership.in_ball(patch.frame.origin, patch.radius)
    if not len(near):
        return 0
    trial, row = state.table.with_candidate(fit)
    rows, points = np.array([row]), pool.points[near]
    height, upward = (values[0] for values in trial.surface(rows, trial.scaled_local(rows, points)))
    length = np.sqrt((upward**2).sum(axis=1))
    explained = np.hypot(patch.noise_std, state.bias) / patch.radius
    close = np.abs(height) <= _NEAR * explained * length
    cosine = np.einsum("ij,ij->i", pool.normals[near], upward @ trial.axes[row]) / length
    votes = int((np.sign(cosine) * (close & (np.abs(cosine) > SHEET_COSINE))).sum())
    return int(np.sign(votes)) if abs(votes) >= _MAJORITY else 0


def turned(touch: Touch) -> Touch:
    """The touch, come from the other side."""
    return replace(touch, approach=-touch.approach)
