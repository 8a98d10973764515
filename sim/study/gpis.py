"""GPIS: a baseline that touches where a Gaussian process of the surface has most variance."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from touchatlas.planner import target_at
from touchatlas.planner.attempts import Target
from touchatlas.planner.places import Places
from touchatlas.planner.view import View
from touchatlas.sim.study.surface_peers import spread


def gpis(view: View, places: Places, scale: float = 0.25, most: int = 300) -> Target | None:
    """The free place of largest variance of a Gaussian process implicit surface.

    Dragiev, Toussaint and Gienger, Gaussian process implicit surfaces for shape estimation and
    grasping, 2011. With the squared exponential, whose length is ``scale`` extents, the variance
    depends on where the surface was touched alone: on at most so many samples, spread evenly.
    """
    points, _ = places.all
    free = np.flatnonzero(view.is_free(points))
    if not len(free):
        return None
    variance = process_variance(
        view.atlas.pool.points[spread(view.atlas.pool.points, most)],
        points[free],
        scale * view.extent,
    )
    return target_at(places, int(free[variance.argmax()]))


def process_variance(samples, points, length: float, noise: float = 1e-3) -> np.ndarray:
    """(n,) variance at points (n, 3) of a process of variance 1 with a squared exponential of some
    length, after samples (m, 3) with a deviation.

    Rasmussen and Williams, Gaussian processes for machine learning, equation 2.26.

    Examples
    --------
    At the only sample the variance is that of the noise, far away that of the process:

    >>> found = process_variance(np.zeros((1, 3)), np.array([[0.0, 0, 0], [9, 0, 0]]), 1.0, 0.1)
    >>> found.round(4).tolist()
    [0.0099, 1.0]
    """
    kernel = np.exp(-0.5 * (cdist(samples, samples) / length) ** 2)
    across = np.exp(-0.5 * (cdist(samples, points) / length) ** 2)
    known = cho_factor(kernel + noise**2 * np.eye(len(samples)))
    return 1.0 - np.einsum("mn,mn->n", across, cho_solve(known, across))
