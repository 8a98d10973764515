"""A planner with learned weights: `pip install examples/learned_planner`, then `--planner learned`.

`train.py 6 --touches 14 --objects sphere torus ellipsoid` learned the weights from 73 touches at
random in `touchatlas/Explore-v0`.
"""

import numpy as np

from touchatlas.sim.benchmark.choosing import candidates

# Of 1, then of each feature of a candidate, then of each product of two: reward, in 1e-3 a second.
WEIGHTS = [
    *(3.711, 0.41, -0.348, 2.723, 1.472),
    *(0.41, 0.0, 0.802, 1.983, 0.046, -3.287, 4.802, 1.225, 1.363, 0.602),
]


def products(features) -> np.ndarray:
    """(n, 15) one, the features (n, 4), and their products."""
    n, k = features.shape
    pairs = [features[:, i] * features[:, j] for i in range(k) for j in range(i, k)]
    return np.column_stack([np.ones(n), features, *pairs])


def learned(view, places):
    """Touches the candidate of which most reward is expected."""
    found = candidates(view, places, 32)
    if not found.targets:
        return None
    return found.targets[int((products(found.features) @ WEIGHTS).argmax())]
